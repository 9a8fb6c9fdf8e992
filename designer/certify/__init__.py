"""Proofs about a study: the least depth error that a configuration allows at all, and which have no design."""
