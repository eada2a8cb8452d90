#!/usr/bin/python3
"""export_aspn.py FOLDER --out FILE.jsonl: accepted measurements with the names of ASPN-23, one measurement_direction_3d_to_points a line.

Each observation is the direction to a feature of the tanker, known by its id alone: obs are the components right and down of the line of sight
over the one along the optical axis (reference frame normalized_image; sensor axes x along the optical axis, y right, z down), lens and
windscreen removed, with their covariance. time_of_validity is mid-exposure in GPS time, ns since 1980-01-06 without leap seconds; frames
without it are left out and counted. integrity is empty: ours is none of the standard's methods.
Needs the generated types (make types).
"""
import argparse
import json
import os
import sys
import tomllib

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
NORMALIZED_IMAGE = 2  # TypeDirection3DToPoint.reference_frame
ID_INCLUDED = 1       # TypeRemotePoint.included_terms: corresponded, position not told


class Lens:
    """From camera pixels, lens and windscreen removed, to components of the line of sight."""

    def __init__(self, rig):
        with open(rig, "rb") as file:
            camera = tomllib.load(file)["camera"]
        focal = camera["focal_mm"] * 1e3 / camera["pitch_um"] if "focal_mm" in camera else None
        self.f = [focal or camera["fx_px"], focal or camera["fy_px"]]
        self.c = [camera["cx_px"], camera["cy_px"]]

    def direction(self, px):
        return [(p - c) / f for p, c, f in zip(px, self.c, self.f)]

    def covariance(self, uu, uv, vv):
        fu, fv = self.f
        return [uu / fu**2, uv / (fu * fv), uv / (fu * fv), vv / fv**2]


def observation(item, lens):
    return {"remote_point": {"included_terms": ID_INCLUDED, "id": item.id, "position_reference_frame": 0, "num_position_components": 0, "position_covariance": []},
            "reference_frame": NORMALIZED_IMAGE, "obs": lens.direction(item.ideal_px), "covariance": lens.covariance(*item.cov_px2),
            "has_observation_characteristics": False, "error_model": 0, "num_error_model_params": 0, "error_model_params": [], "num_integrity": 0, "integrity": []}


def line(message, number, lens, ids):
    obs = [observation(i, lens) for i in message.items if i.accepted]
    return {"message_type": "measurement_direction_3d_to_points", "header": {**ids, "sequence_id": number % 65536},
            "time_of_validity": {"elapsed_nsec": message.mid_exposure_gps_ns}, "num_obs": len(obs), "obs": obs}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", help="sortie or flight")
    parser.add_argument("--out", required=True, help="file to write; must not be there")
    parser.add_argument("--published", help="log of what was published, for a flight that is no sortie")
    parser.add_argument("--vendor", type=lambda s: int(s, 0), default=0x43594300, help="vendor_id, a number of one's own choice")
    parser.add_argument("--device", type=lambda s: int(s, 0), default=1, help="device_id")
    parser.add_argument("--types", default=os.path.join(ROOT, "build/gen/python"), help="folder of the generated Python types")
    args = parser.parse_args()
    sys.path[:0] = [args.types, os.path.dirname(os.path.abspath(__file__))]
    import cyclops
    import event_log
    published = args.published or os.path.join(args.folder, "published.lcm")
    if not os.path.exists(published):
        parser.exit(1, f"export_aspn: {published} is not there; --published names another log\n")
    lens = Lens(os.path.join(args.folder, "rig.toml"))
    ids = {"vendor_id": args.vendor, "device_id": args.device, "context_id": 0}
    written = without_time = 0
    with open(args.out, "x") as out:
        for _, _, channel, payload in event_log.events(published):
            if channel != "MEASUREMENT":
                continue
            message = cyclops.measurement_set_t.decode(payload)
            if message.mid_exposure_gps_ns == 0:
                without_time += 1
                continue
            json.dump(line(message, written, lens, ids), out, allow_nan=False)
            out.write("\n")
            written += 1
    print(f"{args.out}: {written} frames; {without_time} without GPS time left out")
    return 0


if __name__ == "__main__":
    sys.exit(main())
