#!/usr/bin/python3
"""other_objects.py OUT --object NAME [...]: folders for cyclops-import that show anything but an aircraft.

A box with painted patches (24 features) or a chequered board (54), moving before a cluttered background, through a lens that may
distort, with truth that is exact: every pixel is the mean of exact rays. The prior is the true pose with an error of which 80 % of
the variance is first-order Gauss-Markov over 60 frames and 20 % is white, three times as large in depth as across, scaled so that
the mean projection error is what was asked for. The same call gives the same folder.
"""
import argparse
import json
import math
from pathlib import Path

import numpy as np
from PIL import Image

RATE_HZ = 30.0


def turned(vector):
    """Rotation matrix of a rotation vector (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = np.asarray(vector) / max(angle, 1e-12)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * K + (1 - math.cos(angle)) * K @ K


def euler(x, y, z):
    return turned([0, 0, z]) @ turned([0, y, 0]) @ turned([x, 0, 0])


def quaternion(m):
    """w x y z of a rotation matrix: the eigenvector of Bar-Itzhack's K matrix."""
    k = np.array([[m[0, 0] - m[1, 1] - m[2, 2], m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]],
                  [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]],
                  [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
                  [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], np.trace(m)]]) / 3
    x, y, z, w = np.linalg.eigh(k)[1][:, -1]
    return w, x, y, z


class Face:
    """A rectangle in space: corner, two edges, and a painting of grey cells over it."""

    def __init__(self, corner, along_u, along_v, cells):
        self.corner, self.u, self.v, self.cells = (np.asarray(x, float) for x in (corner, along_u, along_v, cells))
        self.normal = np.cross(self.u, self.v)
        self.normal /= np.linalg.norm(self.normal)


def board():
    cells = np.array([[(205 if (i + j) % 2 else 45) for i in range(10)] for j in range(7)], float)
    face = Face([-0.25, -0.175, 0], [0, 0.35, 0], [0.5, 0, 0], cells.T)
    points = [[-0.2 + 0.05 * i, -0.125 + 0.05 * j, 0] for j in range(6) for i in range(9)]
    return [face], np.array(points), [[0]] * len(points)


def box(random):
    w, h, d = 0.16, 0.11, 0.2
    lo, hi = np.array([-w, -h, -d]) / 2, np.array([w, h, d]) / 2
    ex, ey, ez = np.diag([w, h, d])
    sides = [(lo, ey, ex), (lo + ez, ex, ey), (lo, ez, ey), (lo + ex, ey, ez), (lo, ex, ez), (lo + ey, ez, ex)]
    faces, points, on = [], [], []
    for n, (corner, u, v) in enumerate(sides):
        cells = np.full((40, 40), 120.0 + 18 * n)
        for _ in range(14):
            i, j = random.integers(1, 34, 2)
            cells[j:j + random.integers(1, 4), i:i + random.integers(1, 4)] = random.uniform(20, 235)
        i, j = random.integers(8, 20, 2)
        cells[j:j + 10, i:i + 12] = 15 if n % 2 else 240
        for a, b in [(i, j), (i + 12, j), (i, j + 10)][: 3 if n < 4 else 2]:
            points.append(corner + u * a / 40 + v * b / 40)
            on.append([n])
        faces.append(Face(corner, u, v, cells))
    for k in range(8):
        p = np.where([k & 1, k & 2, k & 4], hi, lo)
        points.append(p)
        on.append([n for n, f in enumerate(faces) if abs(f.normal @ (p - f.corner)) < 1e-9])
    return faces, np.array(points), on


class Camera:
    def __init__(self, lens):
        self.width, self.height, self.f = 640, 480, 620.0
        self.cx, self.cy = 322.3, 238.1
        self.k = (-0.28, 0.09, 0.0008, -0.0006) if lens else (0.0, 0.0, 0.0, 0.0)

    def distort(self, x, y):
        k1, k2, p1, p2 = self.k
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * k2)
        return x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y

    def project(self, p):
        x, y = self.distort(p[..., 0] / p[..., 2], p[..., 1] / p[..., 2])
        return np.stack([self.f * x + self.cx, self.f * y + self.cy], -1)

    def rays(self, sub):
        u = (np.arange(self.width * sub) + 0.5) / sub - 0.5
        v = (np.arange(self.height * sub) + 0.5) / sub - 0.5
        xd, yd = np.broadcast_arrays((u[None, :] - self.cx) / self.f, (v[:, None] - self.cy) / self.f)
        x, y = xd.copy(), yd.copy()
        for _ in range(12):
            ax, ay = self.distort(x, y)
            x, y = x + xd - ax, y + yd - ay
        return np.stack([x, y, np.ones_like(x)], -1)


def render(faces, R, t, rays, ground, sub, random):
    grey = ground.copy()
    depth = np.full(grey.shape, np.inf)
    for face in faces:
        n = R @ face.normal
        corner = R @ face.corner + t
        if n @ corner >= 0:
            continue
        with np.errstate(divide="ignore", invalid="ignore"):
            distance = (n @ corner) / (rays @ n)
        hit = rays * distance[..., None] - corner
        a, b = (hit @ (R @ e) / (e @ e) for e in (face.u, face.v))
        on = (a >= 0) & (a < 1) & (b >= 0) & (b < 1) & (distance > 0) & (distance < depth)
        rows, columns = face.cells.shape
        paint = face.cells[np.clip((b * rows).astype(int), 0, rows - 1), np.clip((a * columns).astype(int), 0, columns - 1)]
        light = 0.65 + 0.35 * abs(n @ np.array([0.3, -0.5, -0.81]))
        grey = np.where(on, paint * light, grey)
        depth = np.where(on, distance, depth)
    h, w = grey.shape[0] // sub, grey.shape[1] // sub
    small = grey.reshape(h, sub, w, sub).mean((1, 3))
    return np.clip(np.round(small + random.normal(0, 1.5, small.shape)), 0, 255).astype(np.uint8)


def background(camera, sub, random):
    ground = np.zeros((camera.height * sub, camera.width * sub))
    for size, weight in ((8, 50), (24, 30), (60, 14)):
        coarse = random.uniform(-1, 1, (size * 3 // 4 + 2, size + 2))
        ground += weight * np.asarray(Image.fromarray(coarse.astype(np.float32)).resize(ground.shape[::-1], Image.BICUBIC))
    for _ in range(25):  # things with corners
        u, v = random.integers(0, ground.shape[1]), random.integers(0, ground.shape[0])
        ground[v:v + random.integers(5, 30) * sub, u:u + random.integers(5, 30) * sub] = random.uniform(-90, 90)
    return np.clip(ground + 120, 5, 250)


def noise_series(n, random):
    slow, out = random.normal(), []
    keep = math.exp(-1 / 60)
    for _ in range(n):
        slow = keep * slow + math.sqrt(1 - keep * keep) * random.normal()
        out.append(math.sqrt(0.8) * slow + math.sqrt(0.2) * random.normal())
    return np.array(out)


def main():
    args = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    args.add_argument("out", type=Path)
    args.add_argument("--object", choices=["box", "board"], default="box")
    args.add_argument("--frames", type=int, default=150)
    args.add_argument("--motion-px", type=float, default=3.0, help="mean motion of features, px a frame")
    args.add_argument("--error-px", type=float, default=6.0, help="mean projection error of the prior")
    args.add_argument("--lens", action="store_true", help="a lens that distorts")
    args.add_argument("--seed", type=int, default=1)
    a = args.parse_args()
    random = np.random.default_rng(a.seed)
    camera = Camera(a.lens)
    faces, points, on = board() if a.object == "board" else box(random)
    sub = 3
    rays, ground = camera.rays(sub), background(camera, sub, random)
    phase, rate = random.uniform(0, 2 * math.pi, 6), random.uniform(0.6, 1.4, 6)

    def pose(s):
        w = np.sin(rate * s + phase)
        R = euler(0.35 * w[0], 0.45 * w[1], 0.4 * w[2]) @ (euler(0.5, 0.6, 0.1) if a.object == "box" else euler(0.15, -0.2, 0))
        far = 0.62 if a.object == "box" else 0.75
        return R, np.array([0.09 * w[3], 0.06 * w[4], far + 0.08 * w[5]])

    def pixels(s):
        R, t = pose(s)
        return camera.project(points @ R.T + t)

    def speed(step):
        return np.mean([np.linalg.norm(pixels((k + 1) * step) - pixels(k * step), axis=-1).mean() for k in range(0, a.frames, 5)])

    low, high = 1e-3, 1.0  # s of motion a frame
    for _ in range(40):
        mid = math.sqrt(low * high)
        low, high = (mid, high) if speed(mid) < a.motion_px else (low, mid)
    step = low
    errors = np.stack([noise_series(a.frames, random) for _ in range(6)], -1)
    radius = np.linalg.norm(points - points.mean(0), axis=-1).max()
    middle = points.mean(0)

    def prior(k, scale):
        R, t = pose(k * step)
        centre = R @ middle + t
        lateral = scale * centre[2] / camera.f
        turn = turned(0.5 * lateral / radius * errors[k, 3:])
        moved = centre + lateral * errors[k, :3] * np.array([1, 1, 3])
        return turn @ R, moved - turn @ R @ middle

    def projection_error(scale):
        total = []
        for k in range(a.frames):
            R, t = prior(k, scale)
            total.append(np.linalg.norm(camera.project(points @ R.T + t) - pixels(k * step), axis=-1).mean())
        return np.mean(total)

    scale = a.error_px
    for _ in range(6):
        scale *= a.error_px / projection_error(scale)
    (a.out / "frames").mkdir(parents=True, exist_ok=True)
    k1, k2, p1, p2 = camera.k
    (a.out / "camera.json").write_text(json.dumps({"width": camera.width, "height": camera.height, "fx": camera.f, "fy": camera.f, "cx": camera.cx,
                                                  "cy": camera.cy, "k1": k1, "k2": k2, "p1": p1, "p2": p2, "k3": 0.0}))
    (a.out / "features.csv").write_text("id,x_m,y_m,z_m\n" + "".join(f"{n},{p[0]:.9f},{p[1]:.9f},{p[2]:.9f}\n" for n, p in enumerate(points)))
    poses, truth = ["frame,timestamp_s,x,y,z,qw,qx,qy,qz,nav_update"], ["frame,id,u_px,v_px,visible"]
    for k in range(a.frames):
        R, t = pose(k * step)
        Image.fromarray(render(faces, R, t, rays, ground, sub, random)).save(a.out / "frames" / f"frame_{k:06d}.png", compress_level=1)
        Rp, tp = prior(k, scale)
        poses.append(",".join([str(k), f"{k / RATE_HZ:.9f}"] + [f"{v:.12f}" for v in [*tp, *quaternion(Rp)]] + [str(int(k % 30 == 0))]))
        for n, uv in enumerate(pixels(k * step)):
            seen = any((R @ faces[f].normal) @ (R @ points[n] + t) < 0 for f in on[n])
            inside = 6 <= uv[0] < camera.width - 6 and 6 <= uv[1] < camera.height - 6
            truth.append(f"{k},{n},{uv[0]:.6f},{uv[1]:.6f},{int(seen and inside)}")
    (a.out / "prior.csv").write_text("\n".join(poses) + "\n")
    (a.out / "truth.csv").write_text("\n".join(truth) + "\n")


if __name__ == "__main__":
    main()
