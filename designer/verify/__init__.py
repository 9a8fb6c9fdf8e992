"""The judge: a ray tracer that knows surfaces and apertures, never the closed forms, and its verdict on a design."""
