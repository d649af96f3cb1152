# SPDX-License-Identifier: Apache-2.0
"""Dynamixel servos simulated behind a pseudo terminal, from the protocol 2.0 manual alone."""

from __future__ import annotations

import os
import pty
import select
import threading
import tty

HEADER = b"\xff\xff\xfd\x00"
PING, READ, WRITE, REBOOT, STATUS, SYNC_READ, SYNC_WRITE = 0x01, 0x02, 0x03, 0x08, 0x55, 0x82, 0x83
BROADCAST = 0xFE
RESULT_FAIL, CRC_ERROR, ACCESS_ERROR, ALERT = 0x01, 0x03, 0x07, 0x80

MODE, TORQUE, HARDWARE_ERROR, WATCHDOG, GOAL_CURRENT, GOAL = 11, 64, 70, 98, 102, 116
CURRENT, VELOCITY, POSITION, TEMPERATURE = 126, 128, 132, 146
SIZES = {GOAL_CURRENT: 2, GOAL: 4, CURRENT: 2, VELOCITY: 4, POSITION: 4, 144: 2}


def crc(data: bytes) -> int:
    """CRC-16 with polynomial 0x8005, bit by bit."""
    value = 0
    for byte in data:
        value ^= byte << 8
        for _ in range(8):
            value = (value << 1) ^ 0x8005 if value & 0x8000 else value << 1
            value &= 0xFFFF
    return value


def packet(servo: int, instruction: int, parameters: bytes) -> bytes:
    body = (bytes([instruction]) + parameters).replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")
    head = HEADER + bytes([servo]) + (len(body) + 2).to_bytes(2, "little")
    return head + body + crc(head + body).to_bytes(2, "little")


class Servo:
    """One servo: a control table, and a motor that follows its goal when its torque is on."""

    def __init__(self, position: int = 2048) -> None:
        self.table = bytearray(160)
        self.put(POSITION, position)
        self.put(TEMPERATURE, 30)
        self.put(MODE, 3)
        self.put(GOAL_CURRENT, 1193)
        self.mute = False
        self.corrupt = 0  # how many answers get a wrong checksum
        self.failing = 0  # status error of the next writes
        self.reboots = 0
        self.lowered = 0  # how often the torque was switched off from outside
        self.goals: list[int] = []
        self.heard_at = 0.0

    def get(self, address: int) -> int:
        size = SIZES.get(address, 1)
        data = self.table[address : address + size]
        return int.from_bytes(data, "little", signed=size > 1)

    def put(self, address: int, value: int) -> None:
        size = SIZES.get(address, 1)
        self.table[address : address + size] = value.to_bytes(size, "little", signed=size > 1)

    def look_at_the_watchdog(self, now: float) -> None:
        limit = self.get(WATCHDOG)
        if 0 < limit < 128 and self.get(TORQUE) and now - self.heard_at > 0.02 * limit:
            self.put(WATCHDOG, 255)
        self.heard_at = now

    def write(self, address: int, data: bytes) -> int:
        """Write; return the error of the status packet."""
        if self.failing:
            return self.failing
        tripped = self.get(WATCHDOG) == 255
        if tripped and GOAL_CURRENT - 2 <= address < GOAL + 4:
            return ACCESS_ERROR  # goals are read-only then
        if address == MODE and self.get(TORQUE):
            return ACCESS_ERROR
        if address == TORQUE:
            self.lowered += not data[0]
            if data[0] and not self.get(TORQUE):
                self.put(GOAL, self.get(POSITION))
        self.table[address : address + len(data)] = data
        if address == GOAL:
            self.goals.append(self.get(GOAL))
            if self.get(TORQUE):
                self.put(POSITION, self.get(GOAL))
        return 0

    def restart(self) -> None:
        self.reboots += 1
        mode, position = self.get(MODE), self.get(POSITION)
        self.table[64:] = bytes(len(self.table) - 64)
        self.put(MODE, mode)
        self.put(POSITION, position)
        self.put(TEMPERATURE, 30)

    @property
    def alert(self) -> int:
        return ALERT if self.get(HARDWARE_ERROR) else 0


class DynamixelServos:
    """Servos by id on one bus; `port` is the name of the terminal to open."""

    def __init__(self, *ids: int) -> None:
        self.servos = {servo: Servo() for servo in ids}
        self.bad_crcs = 0
        self.now = 0.0  # s; the servos' clock, which stands still unless it is set
        self._master, slave = pty.openpty()
        tty.setraw(self._master)
        tty.setraw(slave)
        self.port = os.ttyname(slave)
        self._slave = slave
        self._ending = False
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def __getitem__(self, servo: int) -> Servo:
        return self.servos[servo]

    def close(self) -> None:
        """Unplug the adapter."""
        if self._thread.is_alive():
            self._ending = True
            self._thread.join()
            os.close(self._slave)
            os.close(self._master)

    def _serve(self) -> None:
        data = b""
        while not self._ending:
            if not select.select([self._master], [], [], 0.02)[0]:
                continue
            data += os.read(self._master, 4096)
            while (start := data.find(HEADER)) >= 0:
                data = data[start:]
                if len(data) < 7:
                    break
                length = 7 + int.from_bytes(data[5:7], "little")
                if len(data) < length:
                    break
                whole, data = data[:length], data[length:]
                self._answer(whole)

    def _answer(self, whole: bytes) -> None:
        if crc(whole[:-2]) != int.from_bytes(whole[-2:], "little"):
            self.bad_crcs += 1
            return
        to, instruction = whole[4], whole[7]
        parameters = whole[8:-2].replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")
        for servo in self.servos.values():
            if not servo.mute:
                servo.look_at_the_watchdog(self.now)
        if instruction == SYNC_READ:
            address, size = (int.from_bytes(parameters[i : i + 2], "little") for i in (0, 2))
            for each in parameters[4:]:
                if not self._say(each, bytes(self._table(each)[address : address + size])):
                    return  # a servo answers after the one before it
        elif instruction == SYNC_WRITE:
            address, size = (int.from_bytes(parameters[i : i + 2], "little") for i in (0, 2))
            for start in range(4, len(parameters), size + 1):
                servo = self.servos.get(parameters[start])
                if servo is not None and not servo.mute:
                    servo.write(address, parameters[start + 1 : start + 1 + size])
        elif to in self.servos:
            self._answer_one(to, instruction, parameters)

    def _answer_one(self, to: int, instruction: int, parameters: bytes) -> None:
        servo = self.servos[to]
        address = int.from_bytes(parameters[:2], "little")
        if servo.mute:
            return
        if instruction == PING:
            self._say(to, (1020).to_bytes(2, "little") + b"\x2d")
        elif instruction == READ:
            size = int.from_bytes(parameters[2:4], "little")
            self._say(to, bytes(servo.table[address : address + size]))
        elif instruction == WRITE:
            self._say(to, b"", servo.write(address, parameters[2:]))
        elif instruction == REBOOT:
            self._say(to, b"")
            servo.restart()

    def _table(self, servo: int) -> bytearray:
        return self.servos[servo].table if servo in self.servos else bytearray(160)

    def _say(self, servo: int, parameters: bytes, error: int = 0) -> bool:
        one = self.servos.get(servo)
        if one is None or one.mute:
            return False
        answer = packet(servo, STATUS, bytes([error | one.alert]) + parameters)
        if one.corrupt:
            one.corrupt -= 1
            answer = answer[:-1] + bytes([answer[-1] ^ 0x55])
        os.write(self._master, answer)
        return True
