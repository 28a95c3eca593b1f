"""
A process that records numbered messages for ever, for tests that kill it.

Each line that it prints is the number of messages that were brought to the disk by then.
"""

from pathlib import Path
import random
import sys

from active_recon.bags.storage.writer import BagWriter

TYPE, DEFINITION = 'std_msgs/msg/String', 'string data\n'


def message(number):
    """Return the CDR bytes of a String that names its number, of up to 20 kB."""
    noise = random.Random(number).randbytes(number * 997 % 10_000)
    text = f'{number} {noise.hex()}'.encode()
    return b'\0\1\0\0' + (len(text) + 1).to_bytes(4, 'little') + text + b'\0'


def record(folder, seed):
    rng = random.Random(seed)
    bag = BagWriter(folder, max_bytes=300_000)
    bag.add_topic('/chatter', TYPE, DEFINITION)
    number = 0
    while True:
        for _ in range(rng.randrange(40)):
            bag.write('/chatter', message(number), number, number)
            number += 1
        bag.flush()
        sys.stdout.write(f'{number}\n')
        sys.stdout.flush()


if __name__ == '__main__':
    record(Path(sys.argv[1]), int(sys.argv[2]))
