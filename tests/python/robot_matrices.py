"""A robot's TOML as numbers: mass matrix of its joints with the base held, places of its bodies. Written against docs/robots.md alone."""

import math
import tomllib

import numpy as np


def rotation(quaternion):
    w, x, y, z = np.asarray(quaternion, float) / np.linalg.norm(quaternion)
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])


def about(axis, angle):
    half = math.sin(angle / 2)
    return rotation([math.cos(angle / 2), *(half * np.asarray(axis))])


class Robot:
    """Of the text of a robot's TOML."""

    def __init__(self, text):
        self.file = tomllib.loads(text)
        self.bodies = self.file.get("body", [])
        self.names = [b["name"] for b in self.bodies]
        self.parents = [-1 if b["parent"] == "base" else self.names.index(b["parent"]) for b in self.bodies]
        self.prismatic = [b.get("joint") == "prismatic" for b in self.bodies]
        self.axes = [np.array(b["axis"]) / np.linalg.norm(b["axis"]) for b in self.bodies]

    def frames(self, q):
        """Rotation and origin of each body, base axes."""
        all = []
        for k, body in enumerate(self.bodies):
            turn, at = (np.eye(3), np.zeros(3)) if self.parents[k] < 0 else all[self.parents[k]]
            at = at + turn @ body["position"]
            turn = turn @ rotation(body["orientation"])
            if self.prismatic[k]:
                at = at + turn @ self.axes[k] * q[k]
            else:
                turn = turn @ about(self.axes[k], q[k])
            all.append((turn, at))
        return all

    def mass_matrix(self, q):
        """kg.m2, by the kinetic energy of each body; what turns with a joint alone is on the diagonal."""
        n, frames = len(self.bodies), self.frames(q)
        m = np.zeros((n, n))
        for k, body in enumerate(self.bodies):
            turn, at = frames[k]
            center = at + turn @ body["center-of-mass"]
            linear, angular = np.zeros((3, n)), np.zeros((3, n))
            j = k
            while j >= 0:
                axis = frames[j][0] @ self.axes[j]
                if self.prismatic[j]:
                    linear[:, j] = axis
                else:
                    linear[:, j], angular[:, j] = np.cross(axis, center - frames[j][1]), axis
                j = self.parents[j]
            m += body["mass"] * linear.T @ linear + angular.T @ turn @ np.array(body["inertia"]) @ turn.T @ angular
            m[k, k] += body.get("motor", {}).get("inertia", 0.0)
        return m
