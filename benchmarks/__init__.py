"""Benchmarks: how good and how fast the optimiser is. Each is one command; none is a test."""
