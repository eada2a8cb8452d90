"""Reads an LCM event log with all its parts: events as (number, time_us, channel, payload). A cut last event ends its file. Writes one."""
import os
import struct

SYNC = 0xEDA1DA01
MOST = 64 << 20  # bytes of one payload


def parts(path):
    """NAME.lcm, NAME.001.lcm ... as far as they are there"""
    yield path
    name, end = os.path.splitext(path)
    number = 1
    while os.path.exists(part := f"{name}.{number:03d}{end}"):
        yield part
        number += 1


def events(path):
    for part in parts(path):
        yield from events_of_file(part)


def events_of_file(path):
    with open(path, "rb") as file:
        while True:
            head = file.read(28)
            if len(head) < 28:
                return
            sync, number, time_us, channel_size, size = struct.unpack(">IqqII", head)
            if sync != SYNC or channel_size > 255 or size > MOST:
                raise ValueError(f"{path}: no event at byte {file.tell() - 28}")
            channel = file.read(channel_size)
            payload = file.read(size)
            if len(payload) < size:
                return
            yield number, time_us, channel.decode("ascii", "replace"), payload


def write(path, events):
    """Of (time_us, channel, payload), numbered from 0."""
    with open(path, "wb") as file:
        for number, (time_us, channel, payload) in enumerate(events):
            file.write(struct.pack(">IqqII", SYNC, number, time_us, len(channel), len(payload)) + channel.encode() + payload)
