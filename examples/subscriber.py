#!/usr/bin/env python3
"""Prints the poses that posed publishes, without LCM's own Python binding, which Debian has not.

First make the classes:  lcm-gen --python --ppath . /usr/share/posed/messages/*.lcm
Then:                    ./subscriber.py [COUNT]
"""

import socket
import struct
import sys

from posed import pose_t

GROUP, PORT = "239.255.76.67", 7667
SHORT_MESSAGE = 0x4C433032  # "LC02": magic, sequence number, channel, zero byte, the encoded message


def messages():
    """Yields (channel, bytes) of each message that fits into one datagram, as all of posed's but the largest do."""
    receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    receiver.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
    receiver.bind((GROUP, PORT))
    membership = socket.inet_aton(GROUP) + socket.inet_aton("0.0.0.0")
    receiver.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
    while True:
        datagram = receiver.recv(65536)
        if len(datagram) > 8 and struct.unpack(">I", datagram[:4])[0] == SHORT_MESSAGE:
            channel, _, data = datagram[8:].partition(b"\0")
            yield channel.decode(), data


def main():
    left = int(sys.argv[1]) if len(sys.argv) > 1 else -1
    for channel, data in messages():
        if channel == "POSED_POSE":
            pose = pose_t.decode(data)
            if pose.state == pose_t.STATE_TRACKING:
                x, y, z = pose.T_map_base.position
                print(f"{pose.utime} {x:.3f} {y:.3f} {z:.3f}, {pose.inliers} inliers", flush=True)
            else:
                print(f"{pose.utime} no pose, state {pose.state}", flush=True)
            left -= 1
            if left == 0:
                return


if __name__ == "__main__":
    main()
