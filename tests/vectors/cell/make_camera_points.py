#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes camera_points.csv and upright_frames.csv beside itself, apart from this project's code.

Needs numpy and opencv-python-headless. Lengths in metres, angles in radians, pixels as OpenCV counts them:
(0, 0) is the middle of the upper left pixel, so a picture of 1280 x 720 has its middle at (639.5, 359.5).
"""
import csv
import pathlib

import cv2
import numpy as np

HERE = pathlib.Path(__file__).parent
RANDOM = np.random.default_rng(20261124)


def rotation(axis, angle):
    return cv2.Rodrigues(np.asarray(axis, float) * angle)[0]


def quaternion(r):
    """w, x, y, z of a rotation matrix: the eigenvector of the largest eigenvalue of Bar-Itzhack's matrix."""
    k = np.array([[r[0, 0] - r[1, 1] - r[2, 2], r[1, 0] + r[0, 1], r[2, 0] + r[0, 2], r[2, 1] - r[1, 2]],
                  [r[1, 0] + r[0, 1], r[1, 1] - r[0, 0] - r[2, 2], r[2, 1] + r[1, 2], r[0, 2] - r[2, 0]],
                  [r[2, 0] + r[0, 2], r[2, 1] + r[1, 2], r[2, 2] - r[0, 0] - r[1, 1], r[1, 0] - r[0, 1]],
                  [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], np.trace(r)]]) / 3
    x, y, z, w = np.linalg.eigh(k)[1][:, -1]
    return w, x, y, z


def write(name, columns, rows):
    with open(HERE / name, "w", newline="") as file:
        out = csv.writer(file, lineterminator="\n")
        out.writerow(columns)
        out.writerows([[f"{value:.17g}" for value in row] for row in rows])


def camera_rows():
    for _ in range(8):
        focal = RANDOM.uniform(900, 1300, 2)
        centre = np.array([639.5, 359.5]) + RANDOM.uniform(-20, 20, 2)
        distortion = (np.array([-0.15, 0.06, 0.002, 0.002, -0.02]) * RANDOM.uniform(0.3, 1, 5)
                      * [1, 1, *RANDOM.choice([-1, 1], 2), 1])
        position = np.array([0.24, 0, 0.85]) + RANDOM.uniform(-0.1, 0.1, 3)
        tilt = RANDOM.uniform(0.05, 0.3, 2) * RANDOM.choice([-1, 1], 2)
        world_r_camera = (rotation([0, 0, 1], RANDOM.uniform(0.2, 3)) @ rotation([1, 0, 0], np.pi + tilt[0])
                          @ rotation([0, 1, 0], tilt[1]))
        camera_r_world = world_r_camera.T
        matrix = np.array([[focal[0], 0, centre[0]], [0, focal[1], centre[1]], [0, 0, 1]])
        rays = np.column_stack([RANDOM.uniform(-0.45, 0.45, 12), RANDOM.uniform(-0.25, 0.25, 12),
                                np.ones(12)])
        points = position + (rays * RANDOM.uniform(0.5, 1.2, (12, 1))) @ camera_r_world
        pixels = cv2.projectPoints(points, cv2.Rodrigues(camera_r_world)[0], -camera_r_world @ position,
                                   matrix, distortion)[0]
        for point, pixel in zip(points, pixels.reshape(-1, 2)):
            yield [*focal, *centre, *distortion, *position, *quaternion(world_r_camera), *point, *pixel]


def frame_rows():
    for yaw in (0, np.pi / 2, -np.pi / 2, np.pi, *RANDOM.uniform(-np.pi, np.pi, 12)):
        origin, local = RANDOM.uniform(-1, 1, (2, 3))
        world_t_frame = np.array([[np.cos(yaw), -np.sin(yaw), 0, origin[0]],
                                  [np.sin(yaw), np.cos(yaw), 0, origin[1]],
                                  [0, 0, 1, origin[2]], [0, 0, 0, 1]])
        yield [*origin, yaw, *local, *(world_t_frame @ [*local, 1])[:3]]


write("camera_points.csv", ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "px", "py", "pz",
                            "qw", "qx", "qy", "qz",
                            "x", "y", "z", "u", "v"], camera_rows())
write("upright_frames.csv", ["px", "py", "pz", "yaw", "lx", "ly", "lz", "x", "y", "z"], frame_rows())
