"""The report's words: Typst source made from a study folder."""
