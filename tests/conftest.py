"""Its presence puts this folder on the path, so that tests of different rooms share the helpers in it."""
