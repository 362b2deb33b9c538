"""Movers and surfaces of all groups under one numbering: what a coupling reads of bodies, and where it leaves impulses.

    movers     of the groups that do not turn, then of those that do, in the order of the groups
    balls      of the groups with many, then the thin balls of discs, then the points of walls, then of the groups with few
    discs      one for each mover of the groups that have them
    faces      of those groups, where two discs or a disc and a wall can meet
    walls      triangles of the skins of bodies that turn, where a disc with faces can meet them

A coupling puts movers on the list (`who`, in the order of their numbers). Each group fills the fields of its own part of the list
(`offer`), the coupling leaves impulses there, and each group takes its own as forces (`take`). Searches alone ask where elements are
(`look`).
"""

import numpy as np

from .. import runtime
from ..bodies.body import Now
from ..bodies.surface import First, Surface
from ..numerics.turns import eased, turned
from ..runtime import ti
from .places import Places


class Port(Places):
    """Places for all movers; surfaces, in the order of their movers; names and number of bodies.

    n movers, n_still of them do not turn; n_discs; n_balls, n_many of them of groups with many, n_wide of them those, the thin ones and
    the n_points of walls; n_faces, 0 without thin balls; n_walls; n_behind balls stand behind walls.
    """

    def __init__(self, surfaces: list[Surface], thin: bool, walled: bool = False, name: str = "port"):
        """thin: discs have a thin ball each, and faces between them, for two shells can meet, or (walled) a shell and a wall."""
        self.surfaces = surfaces = sorted(surfaces, key=lambda s: s.turns)
        self.thin, self.walled = thin, walled
        self.names = [span.name for s in surfaces for span in s.bodies]
        self.loose = np.array([s.loose for s in surfaces for _ in s.bodies])
        self.n_bodies = len(self.names)
        self.n_still = sum(s.n for s in surfaces if not s.turns)
        super().__init__(name, sum(s.n for s in surfaces), self.n_still, self.n_bodies)
        self.n_discs = sum(s.n for s in surfaces if s.discs is not None)
        many = [s for s in surfaces if s.balls is not None and not s.few]
        few = [s for s in surfaces if s.balls is not None and s.few]
        self.n_many = sum(s.n_balls for s in many)
        skins = [s.walls for s in surfaces if s.walls is not None] if walled else []
        self.n_points, self.n_walls = sum(len(w.arm) for w in skins), sum(len(w.corners) for w in skins)
        self.n_wide = self.n_many + (self.n_discs if thin else 0) + self.n_points
        self.n_faces = sum(len(s.faces.corners) for s in surfaces if s.faces is not None) if thin else 0
        self.n_balls = self.n_wide + sum(s.n_balls for s in few)
        balls: dict[int, int] = {}
        for some, count in ((many, 0), (few, self.n_wide)):
            for s in some:
                balls[id(s)] = count
                count += s.n_balls
        movers, bodies, discs, faces, points, walls = 0, 0, 0, 0, self.n_wide - self.n_points, 0
        for s in surfaces:
            s.first = First(movers, bodies, balls.get(id(s), 0), self.n_many + discs if thin else 0, discs, faces, points, walls)
            movers, bodies, discs = movers + s.n, bodies + len(s.bodies), discs + (s.n if s.discs is not None else 0)
            faces += 0 if s.faces is None else len(s.faces.corners)
            if s.walls is not None and walled:
                points, walls = points + len(s.walls.arm), walls + len(s.walls.corners)
        self._fields()
        self._fill()

    def _fields(self) -> None:
        field, n = self.field, self.n
        bodies, balls, discs, faces = self.n_bodies, self.n_balls, max(self.n_discs, 1), max(self.n_faces, 1)
        self.body = field("body", n, dtype="i32", doc="body of a mover")
        self.speed = field("speed", bodies, dtype="f64", unit="m/s", doc="of the fastest point of a body")
        self.largest = field("largest", bodies, dtype="f64", unit="m", doc="radius of the largest disc of a body", keeps=True)
        self.due = field("due", bodies, dtype="i32", doc="what a body is due for: 0 nothing, 1 shapes of its discs, 2 pairs as well")
        self.linked = field("linked", bodies, dtype="i32", doc="1: a body that is due has found this one")
        self.period = field("period", bodies, dtype="i32", doc="steps of the clock that an impulse on a body stands for")
        self.ball_mover = field("ball_mover", balls, dtype="i32", doc="mover of a ball")
        self.ball_body = field("ball_body", balls, dtype="i32", doc="body of a ball")
        self.ball_radius = field("ball_radius", balls, 2, "f64", unit="m", doc="against balls and lips, against sound discs")
        self.ball_arm = field("ball_arm", balls, 3, "f64", unit="m", doc="from the place of a mover that turns, at t = 0")
        self.ball_x = field("ball_x", balls, 3, "f64", unit="m", doc="place, at the last search")
        self.disc_mover = field("disc_mover", discs, dtype="i32", doc="mover of a disc")
        self.disc_body = field("disc_body", discs, dtype="i32", doc="body of a disc")
        self.disc_half = field("disc_half", discs, dtype="f64", unit="m", doc="half the thickness")
        self.disc_border = field("disc_border", discs, dtype="i32", doc="1 on the border of the reference")
        self.disc_radius = field("disc_radius", discs, dtype="f64", unit="m", doc="of the flat disc", keeps=True)
        self.disc_sound = field("disc_sound", discs, dtype="i32", doc="1: no lip, no border, no fragment", keeps=True)
        self.disc_x = field("disc_x", discs, 3, "f64", unit="m", doc="place, at the last search")
        self.disc_n = field("disc_n", discs, 3, "f64", doc="director, at the last search")
        self.disc_X = field("disc_X", discs if self.thin else 1, 3, "f64", unit="m", doc="place at t = 0")
        self.face_disc = field("face_disc", faces, 4, "i32", doc="discs at the corners of a face, the last one -1 in a triangle")
        self.face_x = field("face_x", faces, 3, "f64", unit="m", doc="mean of the corners, at the last search")
        self.face_reach = field("face_reach", faces, dtype="f64", unit="m", doc="to the farthest corner; below 0 where the cell is broken")
        points, walls = max(self.n_points, 1), max(self.n_walls, 1)
        self.faced = field("faced", bodies, dtype="i32", doc="1: a body has faces, and meets walls themselves")
        self.behind = field("behind", bodies, dtype="i32", doc="1: the balls of a body stand behind walls")
        self.tip = field("tip", points, dtype="i32", doc="1: a point of walls that can be the first to touch")
        self.wall_point = field("wall_point", walls, 3, "i32", doc="balls at the corners of a wall")
        self.wall_x = field("wall_x", walls, 3, "f64", unit="m", doc="mean of the corners, at the last search")
        self.wall_reach = field("wall_reach", walls, dtype="f64", unit="m", doc="to the farthest corner")
        self.widest_face = field("widest_face", bodies, dtype="f64", unit="m", doc="largest reach of a body's faces")

    def _fill(self) -> None:
        """What does not change: elements, bodies, periods."""
        body = np.zeros(self.n, np.int32)
        ball_mover, ball_body = np.zeros(self.n_balls, np.int32), np.zeros(self.n_balls, np.int32)
        radius, arm = np.zeros((self.n_balls, 2)), np.zeros((self.n_balls, 3))
        disc_mover, disc_body = np.zeros(self.n_discs, np.int32), np.zeros(self.n_discs, np.int32)
        half, flat, border = np.zeros(self.n_discs), np.zeros(self.n_discs), np.zeros(self.n_discs, np.int32)
        reference, faces = np.zeros((self.n_discs, 3)), np.zeros((self.n_faces, 4), np.int32)
        tip, wall, reach = np.zeros(self.n_points, np.int32), np.zeros((self.n_walls, 3), np.int32), np.zeros(self.n_walls)
        faced, behind = np.zeros(self.n_bodies, np.int32), np.zeros(self.n_bodies, np.int32)
        self.widest_wall = np.zeros(self.n_bodies)  # m, largest reach of a body's walls
        for s in self.surfaces:
            first = s.first
            if s.balls is not None:
                mine = slice(first.ball, first.ball + len(s.balls.mover))
                ball_mover[mine], ball_body[mine] = first.mover + s.balls.mover, first.body + s.balls.body
                radius[mine] = s.balls.radius
                body[first.mover + s.balls.mover] = first.body + s.balls.body
                if s.balls.arm is not None:
                    arm[mine] = s.balls.arm
            if s.discs is not None:
                mine = slice(first.disc, first.disc + s.n)
                disc_mover[mine], disc_body[mine] = first.mover + np.arange(s.n), first.body + s.discs.body
                body[first.mover : first.mover + s.n] = first.body + s.discs.body
                half[mine], flat[mine] = s.discs.half, s.discs.radius
                border[mine], reference[mine] = s.discs.border, s.discs.reference
                if self.thin:
                    mine = slice(first.thin, first.thin + s.n)
                    ball_mover[mine], ball_body[mine] = first.mover + np.arange(s.n), first.body + s.discs.body
                    radius[mine] = s.discs.half[:, None]  # a ball that does not stand out of the shell
            if s.walls is not None and self.walled:
                w = s.walls
                mine = slice(first.point, first.point + len(w.arm))
                ball_mover[mine], ball_body[mine], arm[mine] = first.mover + w.mover, first.body + w.body, w.arm
                body[first.mover + w.mover] = first.body + w.body  # its balls may be left out
                behind[first.body + np.unique(w.body)] = 1
                begin = first.point - (self.n_wide - self.n_points)
                tip[begin : begin + len(w.arm)] = w.tip
                at = w.arm[w.corners]
                size = np.linalg.norm(at - at.mean(axis=1)[:, None], axis=2).max(axis=1)
                mine = slice(first.wall, first.wall + len(at))
                wall[mine], reach[mine] = first.point + w.corners, size
                np.maximum.at(self.widest_wall, first.body + w.body[w.corners[:, 0]], size)
            if s.faces is not None and self.thin:
                faced[first.body : first.body + len(s.bodies)] = 1
                corners = s.faces.corners
                faces[first.face : first.face + len(corners)] = np.where(corners >= 0, first.disc + corners, -1)
        self.widest = np.zeros(self.n_bodies)  # m, largest of a body's balls that a grid finds
        np.maximum.at(self.widest, ball_body[: self.n_wide], radius[: self.n_wide].max(axis=1))
        np.maximum.at(self.widest, disc_body, half)
        self.half = np.zeros(self.n_bodies)  # m, half the thickness of a body's discs
        np.maximum.at(self.half, disc_body, half)
        put = runtime.put
        put(self.body, body)
        put(self.period, np.concatenate([np.full(len(s.bodies), s.period, np.int32) for s in self.surfaces]))
        put(self.ball_mover, ball_mover)
        put(self.ball_body, ball_body)
        put(self.ball_radius, radius)
        put(self.ball_arm, arm)
        self.n_behind = int(behind[ball_body[self.n_wide :]].sum())
        put(self.faced, faced)
        put(self.behind, behind)
        if self.n_walls:
            put(self.tip, tip)
            put(self.wall_point, wall)
            put(self.wall_reach, reach)
        if self.n_discs:
            put(self.disc_mover, disc_mover)
            put(self.disc_body, disc_body)
            put(self.disc_half, half)
            put(self.disc_border, border)
            put(self.disc_radius, flat)
            largest = np.zeros(self.n_bodies)
            np.maximum.at(largest, disc_body, flat)
            put(self.largest, largest)
            if self.thin:
                put(self.disc_X, reference)
                put(self.face_disc, faces)

    def of(self, body: int) -> Surface:
        """The group of a body, by the body's number."""
        return next(s for s in reversed(self.surfaces) if s.first.body <= body)

    def renew(self) -> None:
        """Whose the movers are: a place in a pool of fluids is not always of the same one."""
        self.look()

    def look(self, places: bool = False) -> None:
        """Speeds of bodies; with `places` where their elements are."""
        for s in self.surfaces:
            s.look(self, places)

    def offer(self, bounds: np.ndarray, now: Now) -> None:
        """Fill the list. bounds: first places of the groups on it, and its end."""
        for s, first, last in zip(self.surfaces, bounds[:-1], bounds[1:], strict=True):
            if last > first:
                s.offer(self, int(first), int(last), now)

    def take(self, bounds: np.ndarray, now: Now) -> None:
        """Hand the impulses on."""
        for s, first, last in zip(self.surfaces, bounds[:-1], bounds[1:], strict=True):
            if last > first:
                s.take(self, int(first), int(last), now)

    @ti.func
    def centre(self, ball, m, turning):
        """Where a ball is now [m], whose mover stands at place m of the list; those from `turning` on turn."""
        c = self.x[m]
        if m >= turning:
            c += turned(self.q[m - turning], self.ball_arm[ball])
        return c

    @ti.func
    def spin(self, m, turning, L):
        """Spin that a moment of impulse L gives to a mover that turns [rad/s]."""
        t = m - turning
        return self.loose_turn[t] * eased(self.pose[t], self.moments[t], L)

    @ti.func
    def loosest(self, m, turning, arm):
        """Change of the speed of the point at `arm` by a unit impulse along any direction, at most [1/kg]."""
        w = self.ease[m].max()
        if m >= turning:
            t = m - turning
            w += self.loose_turn[t] * arm.norm_sqr() / self.moments[t].min()
        return w

    @ti.func
    def mobility(self, m, turning, arm, normal):
        """Change of the normal speed of the point at `arm` by a unit impulse along the normal [1/kg]."""
        w = (self.ease[m] * normal).dot(normal)
        if m >= turning:
            w += self.spin(m, turning, arm.cross(normal)).cross(arm).dot(normal)
        return w

    @ti.func
    def blow(self, body, step):
        """Steps of the clock that an impulse on a body stands for in this one, 0 where it is not its turn."""
        period = self.period[body]
        return period if step % period == 0 else 0
