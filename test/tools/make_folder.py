#!/usr/bin/python3
"""make_folder.py OUT [FRAMES] [NOISE_PX]: pictures of a moving chequered board, as cyclops-import takes them.

The board is the plane z = 0 of the model, 4 m a side, 4 x 4 cells of different grey; the features are eight of its nine
inner corners. Every pixel is the mean of 4 x 4 exact rays, so truth.csv is exact. The prior is the true pose moved by a
slowly turning error of NOISE_PX on the image; the same call gives the same folder.
"""
import json
import math
import sys
from pathlib import Path

import numpy as np
from PIL import Image

WIDTH, HEIGHT, FOCAL = 320, 240, 300.0
CX, CY = (WIDTH - 1) / 2, (HEIGHT - 1) / 2
RATE_HZ, SUB = 30, 4
CORNERS = [(x, y) for y in (-1, 0, 1) for x in (-1, 0, 1) if (x, y) != (0, 0)]


def rotation(yaw, pitch, roll):
    def turn(axis, a):
        i, j = [(1, 2), (2, 0), (0, 1)][axis]
        m = np.eye(3)
        m[i, i] = m[j, j] = math.cos(a)
        m[i, j], m[j, i] = -math.sin(a), math.sin(a)
        return m
    return turn(1, yaw) @ turn(0, pitch) @ turn(2, roll)


def quaternion(m):
    w = math.sqrt(max(0.0, 1 + np.trace(m))) / 2  # the board never turns far: w stays large
    return [w, (m[2, 1] - m[1, 2]) / (4 * w), (m[0, 2] - m[2, 0]) / (4 * w), (m[1, 0] - m[0, 1]) / (4 * w)]


def pose(k):
    s = k / RATE_HZ
    return rotation(0.15 * math.sin(s), 0.1 * math.cos(1.3 * s), 0.2 + 0.1 * s), np.array([0.3 * math.sin(2 * s), 0.2 * math.cos(s), 9.0 - 0.6 * s])


def render(R, t, cells, random):
    n = SUB
    u = (np.arange(WIDTH * n) + 0.5) / n - 0.5
    v = (np.arange(HEIGHT * n) + 0.5) / n - 0.5
    rays = np.stack(np.broadcast_arrays((u[None, :] - CX) / FOCAL, (v[:, None] - CY) / FOCAL, 1.0), -1)
    normal = R[:, 2]
    hit = rays * (normal @ t / (rays @ normal))[..., None] - t
    x, y = hit @ R[:, 0], hit @ R[:, 1]
    i, j = np.floor(x).astype(int) + 2, np.floor(y).astype(int) + 2
    on = (i >= 0) & (i < 4) & (j >= 0) & (j < 4)
    grey = np.where(on, cells[np.clip(j, 0, 3), np.clip(i, 0, 3)], 90.0)
    small = grey.reshape(HEIGHT, n, WIDTH, n).mean((1, 3)) + random.normal(0, 1.0, (HEIGHT, WIDTH))
    return np.clip(np.round(small), 0, 255).astype(np.uint8)


def main():
    words = sys.argv[1:] + ["60", "2"][len(sys.argv) - 2:]
    out, frames, noise = Path(words[0]), int(words[1]), float(words[2])
    (out / "frames").mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(7)
    cells = np.array([[(215 if (i + j) % 2 else 35) + 6 * ((3 * i + 5 * j) % 4) for i in range(4)] for j in range(4)], float)
    (out / "camera.json").write_text(json.dumps({"width": WIDTH, "height": HEIGHT, "fx": FOCAL, "fy": FOCAL, "cx": CX, "cy": CY}))
    (out / "features.csv").write_text("id,x_m,y_m,z_m\n" + "".join(f"{n + 1},{x},{y},0\n" for n, (x, y) in enumerate(CORNERS)))
    prior, truth = ["frame,timestamp_s,x,y,z,qw,qx,qy,qz,nav_update"], ["frame,id,u_px,v_px,visible"]
    for k in range(frames):
        R, t = pose(k)
        Image.fromarray(render(R, t, cells, random)).save(out / "frames" / f"frame_{k:04d}.png", compress_level=1)
        wrong = t + t[2] / FOCAL * noise * np.array([math.cos(0.1 * k), math.sin(0.1 * k), 0.0])
        prior.append(",".join([str(k), f"{k / RATE_HZ:.9f}"] + [f"{x:.12f}" for x in [*wrong, *quaternion(R)]] + ["1"]))
        for n, (x, y) in enumerate(CORNERS):
            p = R @ np.array([x, y, 0.0]) + t
            truth.append(f"{k},{n + 1},{FOCAL * p[0] / p[2] + CX:.6f},{FOCAL * p[1] / p[2] + CY:.6f},1")
    (out / "prior.csv").write_text("\n".join(prior) + "\n")
    (out / "truth.csv").write_text("\n".join(truth) + "\n")


if __name__ == "__main__":
    main()
