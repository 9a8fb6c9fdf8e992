"""``study.html``: one file to look at a study in a browser, without network, Matplotlib or Typst."""
