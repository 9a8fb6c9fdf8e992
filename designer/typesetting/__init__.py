"""Pages from Typst source: pieces of markup, the characters that its fonts have, and PDF bytes."""
