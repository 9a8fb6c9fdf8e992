"""From light to points: what a design's camera records, and the point cloud recovered from it."""
