"""Pixels of OpenCV's two camera models, radial parts: python -m validation.others.opencv_models."""

import cv2
import numpy as np

MATRIX = np.array([[600.0, 0.0, 799.5], [0.0, 600.0, 599.5], [0.0, 0.0, 1.0]])
FISHEYE = np.array([-0.02, 0.003, -0.0005, 0.0001])
PINHOLE = np.array([-0.1, 0.02, 0.0, 0.0, -0.003])  # k1, k2, p1, p2, k3
NOWHERE = np.zeros(3)


def point(psi_deg: float, azimuth_deg: float) -> np.ndarray:
    psi, azimuth = np.radians([psi_deg, azimuth_deg])
    return np.array([[[np.sin(psi) * np.cos(azimuth), np.sin(psi) * np.sin(azimuth), np.cos(psi)]]])


fisheye, _ = cv2.fisheye.projectPoints(point(50.0, 30.0), NOWHERE, NOWHERE, MATRIX, FISHEYE)
pinhole, _ = cv2.projectPoints(point(30.0, 30.0), NOWHERE, NOWHERE, MATRIX, PINHOLE)
print("OpenCV", cv2.__version__)
print(f"fisheye {fisheye.ravel()[0]:.10f}")
print(f"pinhole {pinhole.ravel()[0]:.10f}")
