"""Choosing the conic parameters of a configuration: variants, the program, its starts and its solution."""
