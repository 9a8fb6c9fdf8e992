"""Sweeps: many requirements times 44 configurations, planned as a tree, stored as they finish, resumable."""
