"""An order: all that a workshop needs of a design, in one folder."""
