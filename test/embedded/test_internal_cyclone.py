# SPDX-License-Identifier: Apache-2.0
"""What the binding of Cyclone DDS must not be led into."""

import os
import subprocess
import sys

import pytest

from embedded_ros.transport import available_transports

pytestmark = pytest.mark.skipif(
    "cyclone" not in available_transports(), reason="cyclonedds is not installed"
)

# Samples of all types share what the library keeps of instances, and that is of the first type.
TYPES_COME_AND_GO = """
import os, time
from embedded_ros.transport import Qos
from embedded_ros.transport.cyclone import CycloneParticipant

def enter(number):
    participant = CycloneParticipant(int(os.environ["ROS_DOMAIN_ID"]))
    names = f"rt/t{number}", f"test_msgs::msg::dds_::T{number}_", "RIHS01_" + 20 * str(number)
    return participant, participant.create_writer(*names, Qos(transient_local=True, depth=1))

def leave(participant, writer):
    writer.close()
    participant.close()

for _ in range(20):
    first, second, third = (enter(number) for number in range(3))
    first[1].write(bytes(8))
    second[1].write(bytes(8))
    leave(*first)
    del first
    third[1].write(bytes(8))
    fourth = enter(3)
    fourth[1].write(bytes(8))
    leave(*third)
    del third
    time.sleep(0.05)
    for _ in range(100):
        second[1].write(bytes(8))
    leave(*second)
    leave(*fourth)
    del second, fourth
print("well")
"""


def test_types_come_and_go_while_others_write():
    # glibc fills freed memory, so that who still reads it is found out.
    environment = {**os.environ, "MALLOC_PERTURB_": "165"}
    command = [sys.executable, "-c", TYPES_COME_AND_GO]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, "well\n"), done.stderr
