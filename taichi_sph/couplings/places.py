"""A list of movers: what each of them is and would do, and the impulses that a coupling leaves for it."""

from ..pool import Pool


class Places(Pool):
    """n places; those from `turning` on are movers that turn. bodies: how many bodies `pushed` tells apart."""

    def __init__(self, name: str, n: int, turning: int, bodies: int = 1):
        super().__init__(name)
        field, turn = self.field, max(n - turning, 1)
        self.n, self.turning = n, turning
        self.who = field("who", n, dtype="i32", doc="mover at a place of the list")
        self.whose = field("whose", n, dtype="i32", doc="its body")
        self.pushed = field("pushed", bodies, dtype="i32", doc="1: the impulses on a body count in this step")
        self.x = field("x", n, 3, "f64", unit="m", doc="place of a mover")
        self.director = field("director", n, 3, "f64", doc="of a mover with a disc")
        self.before = field("before", n, 3, "f64", unit="m/s", doc="velocity at n - 1/2")
        self.free = field("free", n, 3, "f64", unit="m/s", doc="velocity at n + 1/2 if there were no contact (T 3.17)")
        self.ease = field("ease", n, 3, "f64", unit="1/kg", doc="inverse mass, 0 in the components that are prescribed")
        self.impulse = field("impulse", n, 3, "f64", unit="N s", doc="on a mover")
        # by place behind the movers that do not turn
        self.q = field("q", turn, 4, "f64", doc="turn from t = 0 to now")
        self.pose = field("pose", turn, 4, "f64", doc="turn of the principal axes")
        self.moments = field("moments", turn, 3, "f64", unit="kg m2", doc="principal moments of inertia")
        self.loose_turn = field("loose_turn", turn, dtype="f64", doc="1, and 0 where turning is prescribed")
        self.spin_before = field("spin_before", turn, 3, "f64", unit="rad/s", doc="spin at n - 1/2")
        self.spin_free = field("spin_free", turn, 3, "f64", unit="rad/s", doc="spin at n + 1/2 if there were no contact")
        self.twist = field("twist", turn, 3, "f64", unit="N m s", doc="moment of impulse on a mover")
