"""What a camera records: scenes, textures, the pupil of the lens, the detector."""
