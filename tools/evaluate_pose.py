"""Relative position from one frame's published measurements alone, beside what their covariances allow (the Cramer-Rao bound).

Poses are T_c_k: p_c = R p_k + t; tanker body k, camera c (right, down, out), metres. All frames are worked out at once: arrays have
the frame as first axis, features as second. Error state as in src/msg/chain.hpp, Alignment: rotation vector about the tanker INS in
camera axes, then translation; true R = exp(rotation) R.
"""
import numpy as np

LEAST_FEATURES = 6    # of a frame that is fitted
HUBER = 2.0           # Mahalanobis distance from which a measurement counts less: 2 degrees of freedom, 13 % of honest ones lie beyond


def rotation(q):
    """Matrices of unit quaternions w x y z."""
    w, x, y, z = np.moveaxis(np.asarray(q, float), -1, 0)
    return np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                     2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], -1).reshape(*w.shape, 3, 3)


def exponential(v):
    """Rotation matrices of rotation vectors (Rodrigues)."""
    angle = np.linalg.norm(v, axis=-1)[..., None, None]
    k = np.zeros(v.shape[:-1] + (3, 3))
    k[..., 0, 1], k[..., 0, 2], k[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    k -= np.swapaxes(k, -1, -2)
    small = angle < 1e-9
    safe = np.where(small, 1, angle)
    return np.eye(3) + np.where(small, 1, np.sin(safe) / safe) * k + np.where(small, .5, (1 - np.cos(safe)) / safe ** 2) * (k @ k)


def project(rig, R, t, points):
    """Ideal pixels (frames, features, 2) and their derivatives by the error state (frames, features, 2, 6)."""
    turned = np.einsum("nij,fj->nfi", R, points)
    p = turned + t[:, None, :]
    z = np.where(p[..., 2] > .1, p[..., 2], np.nan)
    uv = np.stack([rig["fx"] * p[..., 0] / z + rig["cx"], rig["fy"] * p[..., 1] / z + rig["cy"]], -1)
    by_p = np.zeros(p.shape[:2] + (2, 3))
    by_p[..., 0, 0], by_p[..., 0, 2] = rig["fx"] / z, -rig["fx"] * p[..., 0] / z ** 2
    by_p[..., 1, 1], by_p[..., 1, 2] = rig["fy"] / z, -rig["fy"] * p[..., 1] / z ** 2
    by_rotation = np.cross(turned[:, :, None, :], by_p)  # d/dw of p . (w x turned) = (turned x p)
    return uv, np.concatenate([by_rotation, by_p], -1)


def whitening(covariance):
    """W with W^T W = covariance^-1 (…, 2, 2); zero where the covariance is none."""
    a, b, d = covariance[..., 0, 0], covariance[..., 0, 1], covariance[..., 1, 1]
    det = a * d - b * b
    good = np.isfinite(det) & (det > 0) & (a > 0)
    a, b, det = np.where(good, a, 1), np.where(good, b, 0), np.where(good, det, 1)
    w = np.zeros(covariance.shape)
    w[..., 0, 0], w[..., 1, 0], w[..., 1, 1] = 1 / np.sqrt(a), -b / np.sqrt(a * det), np.sqrt(a / det)
    return np.where(good[..., None, None], w, 0), good


def fit(rig, points, pixels, covariance, used, R, t, huber=HUBER, passes=12):
    """Weighted fit of a pose to each frame's pixels, Huber's weights by Mahalanobis distance (huber=None: none); R, t: the start.
    Returns R, t, information (frames, 6, 6) of all measurements with the weights of their covariances alone."""
    W, good = whitening(covariance)
    W = np.where((used & good)[..., None, None], W, 0)
    pixels = np.where((used & good)[..., None], pixels, 0)
    for _ in range(passes):
        uv, J = project(rig, R, t, points)
        J = np.nan_to_num(W @ J)
        r = np.nan_to_num(np.einsum("nfij,nfj->nfi", W, pixels - uv))
        distance = np.linalg.norm(r, axis=-1)
        weight = np.ones_like(distance) if huber is None else np.minimum(1, huber / np.maximum(distance, 1e-9))
        H = np.einsum("nf,nfik,nfil->nkl", weight, J, J) + 1e-9 * np.eye(6)
        step = np.linalg.solve(H, np.einsum("nf,nfik,nfi->nk", weight, J, r)[..., None])[..., 0]
        R, t = exponential(step[:, :3]) @ R, t + step[:, 3:]
        if np.abs(step).max(initial=0) < 1e-9:
            break
    return R, t, np.einsum("nfik,nfil->nkl", J, J)


def by_frame(features, ids, count, column):
    """A column of the table as (frames, ids); NaN where the table has no row."""
    out = np.full((count, len(ids)), np.nan)
    at = np.searchsorted(ids, features["id"])
    out[features["frame"], at] = features[column]
    return out


def positions(features, frames, rig):
    """Per fitted frame: index, error of the position (m, camera axes), its bound (3x3), and the error's squared Mahalanobis distance."""
    known = {f["id"]: f["p_k"] for f in rig["features"]}
    features = features[np.isin(features["id"], list(known))]
    ids = np.unique(features["id"])
    points, n = np.array([known[i] for i in ids]).reshape(-1, 3), len(frames)
    pick = lambda *columns: np.stack([by_frame(features, ids, n, c) for c in columns], -1)
    used = np.nan_to_num(pick("measured")[..., 0]) > 0
    fitted = np.flatnonzero((used.sum(1) >= LEAST_FEATURES) & (frames["has_pose"] > 0))
    if not len(fitted):
        return fitted, np.zeros((0, 3)), np.zeros((0, 3, 3)), np.zeros(0)
    used = used[fitted]
    truth = pick("true_ideal_u", "true_ideal_v")[fitted]
    exact = np.broadcast_to(np.eye(2), truth.shape + (2,))
    R, t = rotation(frames["pose_q"][fitted]), frames["pose_t"][fitted]
    R, t, _ = fit(rig, points, truth, exact, np.isfinite(truth).all(-1), R, t, huber=None)  # the mount of the rig file is not the real one
    cov = pick("cov_uu", "cov_uv", "cov_uv", "cov_vv")[fitted].reshape(*used.shape, 2, 2)
    _, found, information = fit(rig, points, pick("ideal_u", "ideal_v")[fitted], cov, used, R, t)
    bound = np.linalg.inv(information + 1e-9 * np.eye(6))[:, 3:, 3:]
    error = found - t
    return fitted, error, bound, np.einsum("ni,nij,nj->n", error, np.linalg.inv(bound), error)
