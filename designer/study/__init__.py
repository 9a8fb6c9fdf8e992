"""One requirement times 44 configurations: running, sweeping, storing."""
