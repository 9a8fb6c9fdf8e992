"""One sensor as it was built: where its mirrors and its camera really image, and what its tolerances cost."""
