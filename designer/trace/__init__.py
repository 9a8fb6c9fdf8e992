"""How light travels: the instrument as surfaces, and rays followed from one to the next; knows no closed form."""
