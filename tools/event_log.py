"""Reads an LCM event log: events as (number, time_us, channel, payload). A cut last event ends the log."""
import struct

SYNC = 0xEDA1DA01
MOST = 64 << 20  # bytes of one payload


def events(path):
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
