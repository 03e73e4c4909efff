# SPDX-FileCopyrightText: The VLP calibration toolbox authors
# SPDX-License-Identifier: Apache-2.0
"""Simulated results of a fleet with known truth, in the form of session.json of vlp-calibrate."""
import datetime
import math
import random

# Standard deviations reported by the sessions of datasets/archive, and the ratio of the actual scatter to them.
SDS = {"focal": ("px", 0.025, 1.7), "principal_point": ("px", 0.029, 1.7), "zenith": ("deg", 0.006, 1.5)}
SDS |= {"rotation_center": ("px", 0.013, 1.2), "lever_arm": ("mm", 0.075, 1.1), "dispersion_offset": ("px", 0.003, 5)}
NOISY = 3
LAMP_SD_MM, LAMP_SCATTER = 0.06, 1.5
PLACES = {i + 1: complex(-0.6 + 0.6 * (i % 3), -0.3 + 0.6 * (i // 3)) for i in range(6)}


class Fleet:
    """Fleet with `sessions` sessions per camera, evenly over a year, alternately in two rooms.

    drifts   {camera: {parameter: total change of x and y}}
    broken   {camera: (session, {parameter: (x, y)})}: a step at this session
    moved    [(room, lamp, day, displacement in mm as a complex number)]
    honest   sessions scatter by their reported standard deviations
    unequal  sessions report 1 / unequal to unequal times SDS, and scatter by these and by the same sd between sessions
    noisy    cameras whose sessions scatter NOISY times as much
    tails    degrees of freedom of errors with Student's t, of the same standard deviation; 0: normal
    understated   ratio of the actual to the reported standard deviations
    """

    def __init__(
        self, seed, cameras=20, sessions=10, drifts=(), broken=(), moved=(), honest=False, unequal=1, noisy=(),
        tails=0, understated=1
    ):
        self.chance = random.Random(seed)
        self.cameras, self.sessions, self.honest, self.unequal = cameras, sessions, honest, unequal
        self.noisy, self.tails, self.understated = frozenset(noisy), tails, understated
        self.drifts, self.broken, self.moved = dict(drifts), dict(broken), list(moved)
        self.rooms = [self.draw_map_errors() for _ in range(2)]

    def draw_map_errors(self):
        return {lamp: complex(self.chance.gauss(0, 0.5), self.chance.gauss(0, 0.5)) for lamp in PLACES}

    def error(self, sd):
        """Draws an error with this standard deviation."""
        error = self.chance.gauss(0, sd)
        if self.tails:
            error /= math.sqrt(self.chance.gammavariate(self.tails / 2, 2) / (self.tails - 2))
        return error

    def day(self, camera, session):
        return round(365 * (session * self.cameras + camera) / (self.cameras * self.sessions - 1))

    def date(self, day):
        return (datetime.date(2025, 1, 1) + datetime.timedelta(days=day)).isoformat()

    def room(self, camera, session):
        return (camera + session) % 2

    def all(self):
        """Yields (camera, session, session.json) of each session."""
        for camera in range(self.cameras):
            nominal = {name: (self.chance.gauss(0, 1), self.chance.gauss(0, 1)) for name in SDS}
            nominal["focal"] = (260 + nominal["focal"][0], 260 + nominal["focal"][1])
            for session in range(self.sessions):
                name = f"{self.date(self.day(camera, session))}-{session:02d}"
                yield f"camera-{camera:02d}", name, self.result(camera, session, nominal)

    def result(self, camera, session, nominal):
        calibration = {"tilt_deg": 0.5}
        for name, (unit, sd, factor) in SDS.items():
            between = 0 if self.honest else sd * math.sqrt(factor**2 - 1)
            if self.unequal > 1:
                sd *= self.unequal ** self.chance.uniform(-1, 1)
            scatter = math.hypot(sd, between) * (NOISY if camera in self.noisy else 1)
            drift = self.drifts.get(camera, {}).get(name, (0, 0))
            since, jump = self.broken.get(camera, (0, {}))
            jump = jump.get(name, (0, 0)) if session >= since else (0, 0)
            elapsed = self.day(camera, session) / 365
            values = [nominal[name][i] + drift[i] * elapsed + jump[i] + self.error(scatter) for i in (0, 1)]
            calibration |= {f"{name}_{unit}": values, f"{name}_sd_{unit}": [sd / self.understated] * 2}
        room = self.room(camera, session)
        offsets = self.offsets(room, self.day(camera, session))
        lamps = [
            {
                "lamp": lamp,
                "captures": 12,
                "map_m": [PLACES[lamp].real, PLACES[lamp].imag],
                "offset_mm": [off.real, off.imag],
                "offset_sd_mm": [LAMP_SD_MM * self.chance.uniform(0.7, 1.3) for _ in "xy"],
            }
            for lamp, off in offsets.items()
        ]
        inputs = [{"file": "lamps.yaml", "sha256": str(room) * 64}]
        return {
            "verdict": "pass",
            "reason": "",
            "metrics": [{"name": "rms_px", "step": "lens", "value": 0.02}],
            "steps": [{"name": "check", "lamp_offsets": lamps}],
            "calibration": calibration,
            "history": [{"part": "rotation_center", "inputs": inputs}],
        }

    def offsets(self, room, day):
        """Returns the offset of each lamp relative to the others, from the similarity that fits the others."""
        now = dict(self.rooms[room])
        for of_room, lamp, since, by in self.moved:
            if of_room == room and day >= since:
                now[lamp] += by
        sd = LAMP_SD_MM * (1 if self.honest else LAMP_SCATTER) / 1.4  # includes the noise of the other lamps
        now = {lamp: error + complex(self.error(sd), self.error(sd)) for lamp, error in now.items()}
        offsets = {}
        for lamp in PLACES:
            others = [other for other in PLACES if other != lamp]
            middle = sum(PLACES[other] for other in others) / len(others)
            shift = sum(now[other] for other in others) / len(others)
            turn = sum((PLACES[other] - middle).conjugate() * (now[other] - shift) for other in others)
            turn /= sum(abs(PLACES[other] - middle) ** 2 for other in others)
            offsets[lamp] = now[lamp] - shift - turn * (PLACES[lamp] - middle)
        return offsets
