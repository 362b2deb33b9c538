"""Von Mises plasticity of a shell: equivalent stress in global form, and the return to the yield surface.

Of a cross-section, m is the membrane stress, b = sigma_b / sqrt(3) with the skin stress sigma_b = 6 M / e^2 and
s the mean transverse shear stress. b works on the curvature times e / sqrt(12), the radius of gyration of the
section, so m, b and s are conjugate to strains (eps, beta, gamma) with one volume e for all. With the von Mises
product (x, y) = x11 y11 + x22 y22 + 3 x12 y12 - 1/2 (x11 y22 + x22 y11), T 2.43 to 2.47 read

    sigma_eq^2 = (m, m) + 2 c (m, b) + 3 alpha^2 (b, b) + 3 kappa s.s,      c = +- alpha / 2 with the sign of (m, b)

(Ilyushin's cross term is never negative, T 2.43 prints it without its sign). alpha is constant: T speaks of
Crisfeld's gradual hinge but gives no law for it. alpha = 2/3: M = sigma_y e^2 / 4, the full hinge; alpha = 1:
M = sigma_y e^2 / 6, yield of the skin. The flow is normal to the surface in these conjugate strains,
d(eps, beta, gamma) = dp d sigma_eq / d(m, b, s), so sigma_eq dp is the work and, in a hinge, p is the mean plastic
strain over the thickness.

**Return** (annexes B and D, in the effective stress of T 2.76, implicit instead of B.8's approximation). H and
the von Mises product share eigenvectors, and c mixes m and b alike in all of them: in the directions x, y that
diagonalise [[1, c], [c, 3 alpha^2]] = diag(g_x, g_y), the returned stress is the trial one divided by 1 + l h g,

    h = E / (2 (1 - nu)) for 11 + 22,    3 G for 11 - 22 and 12,    l = dp / sigma_y(dp)

so one scalar equation is left, sigma_eq(l) = sigma_y(lambda + (1 - D_r) dp). Its left side falls and lies between
those of the smallest and largest h g, so the root is bracketed: Newton on sigma_y / sigma_eq, which is linear for
one mode, and halving where it leaves the bracket. It cannot fail.

**Edge.** The surface has an edge at (m, b) = 0, towards which stretching drives bending. There any c between
-alpha/2 and alpha/2 is allowed, and that one is taken which returns to (m, b) = 0.
"""

from ..runtime import ti
from . import hardening

NEAR = 1e-6  # of sigma_y: Newton's last step takes it to the square of this
EDGE = 1e-5  # of sigma_y^2: what may be left of (m, b) on the edge


@ti.func
def product(a11, a22, a12, b11, b22, b12):
    """The von Mises product of two plane stresses."""
    return a11 * b11 + a22 * b22 + 3.0 * a12 * b12 - 0.5 * (a11 * b22 + a22 * b11)


@ti.func
def equivalent2(s: ti.template(), alpha, kappa):
    """sigma_eq^2 of s = (m11, m22, m12) or (m, b, s1, s2)."""
    result = product(s[0], s[1], s[2], s[0], s[1], s[2])
    if ti.static(s.n > 3):
        cross = product(s[0], s[1], s[2], s[3], s[4], s[5])
        result += alpha * ti.abs(cross) + 3.0 * alpha * alpha * product(s[3], s[4], s[5], s[3], s[4], s[5])
        result += 3.0 * kappa * (s[6] * s[6] + s[7] * s[7])
    return result


@ti.func
def pressure2(s: ti.template(), alpha):
    """sigma_H^2, with bending taking part as in sigma_eq: sigma_H / sigma_eq = 1/3 in uniaxial tension and bending."""
    m = s[0] + s[1]
    result = m * m
    if ti.static(s.n > 3):
        b = s[3] + s[4]
        cross = product(s[0], s[1], s[2], s[3], s[4], s[5])
        sign = 1.0
        if cross < 0.0:
            sign = -1.0
        result = ti.max(m * m + sign * alpha * m * b + 3.0 * alpha * alpha * b * b, 0.0)
    return result / 9.0


@ti.func
def strength_after(material: ti.template(), body, lam, more, stress):
    """(sigma_y, slope) [Pa] of the material's hardening at lam + more, where it is `stress` at lam."""
    result, slope = stress, stress * 0.0
    if ti.static(material.tabulated):
        result, slope = hardening.table(lam + more, material.points, material.first_point[body], material.n_points[body])
    elif ti.static(material.exact):
        result, slope = hardening.power_after(
            lam, more, stress, material.yield_stress[body], material.hardening[body], material.exponent[body]
        )
    else:  # sums of small increments lose too much in f32
        result, slope = hardening.power(lam + more, material.yield_stress[body], material.hardening[body], material.exponent[body])
    return result, slope


@ti.func
def multiplier(material: ti.template(), body, a: ti.template(), k: ti.template(), flow, lam, kept, rate_factor):
    """(dp, sigma_y) that satisfy sum_j a_j / (1 + k_j dp / sigma_y)^2 = sigma_y(lam + kept dp)^2.

    a: squares of the trial stress by mode [Pa2]; k: h g of the modes [Pa]; flow: sigma_y at dp = 0, without its rate
    factor. dp = 0 where the trial stress lies within.
    """
    first = rate_factor * flow
    trial2, least, steep = a[0] * 0.0, k[0], a[0] * 0.0
    for j in ti.static(range(a.n)):
        trial2 += a[j]
        steep += a[j] * k[j]
        if a[j] > 0.0:
            least = ti.min(least, k[j])
    trial = ti.sqrt(trial2)
    dp, now = first * 0.0, first
    if trial > first:
        low, high = dp, (trial - first) / least
        stress, slope = strength_after(material, body, lam, dp, flow)
        dp = ti.min((trial - first) / (steep / trial2 + rate_factor * kept * slope), high)
        going, round = 1, 0
        while going == 1:
            stress, slope = strength_after(material, body, lam, kept * dp, flow)
            now = rate_factor * stress
            slope *= rate_factor * kept
            reach = dp / now  # l, and its derivative after dp
            reach_dp = (1.0 - reach * slope) / now
            eq2, eq2_l = first * 0.0, first * 0.0
            for j in ti.static(range(a.n)):
                d = 1.0 / (1.0 + k[j] * reach)
                part = a[j] * d * d
                eq2 += part
                eq2_l -= 2.0 * k[j] * d * part
            root = ti.sqrt(eq2)
            off = now / root - 1.0  # negative below the root
            if off < 0.0:
                low = dp
            else:
                high = dp
            after = dp - off * root / (slope - 0.5 * now / eq2 * eq2_l * reach_dp)
            round += 1
            if ti.abs(off) <= NEAR or round == 60:
                going = 0  # the step that is still made squares what is left
                after = ti.min(ti.max(after, low), high)
                now += slope * (after - dp)
            elif not (after > low and after < high):
                after = 0.5 * (low + high)
            dp = after
    return dp, now


@ti.func
def modes(x: ti.template(), y: ti.template()):
    """The parts of the von Mises product of two plane stresses that belong to 11 + 22, and to 11 - 22 and 12."""
    return 0.25 * (x[0] + x[1]) * (y[0] + y[1]), 0.75 * (x[0] - x[1]) * (y[0] - y[1]) + 3.0 * x[2] * y[2]


@ti.func
def return_plane(material: ti.template(), body, s: ti.template(), bulk, shear, flow, lam, kept, rate_factor):
    """(returned stress, dp, sigma_y) of a trial stress s (m11, m22, m12) beyond the surface; bulk = E/(2(1-nu)), shear = 3G."""
    a1, a2 = modes(s, s)
    dp, now = multiplier(material, body, ti.Vector([a1, a2]), ti.Vector([bulk, shear]), flow, lam, kept, rate_factor)
    mean, half = 0.5 * (s[0] + s[1]) / (1.0 + bulk * dp / now), 0.5 * (s[0] - s[1])
    less = 1.0 / (1.0 + shear * dp / now)
    r = ti.Vector([mean + less * half, mean - less * half, less * s[2]])
    return r * (now / ti.sqrt(product(r[0], r[1], r[2], r[0], r[1], r[2]))), dp, now


@ti.func
def return_with(material: ti.template(), body, s: ti.template(), c, bulk, shear, sheared, flow, lam, kept, rate_factor):
    """(returned stress, dp, sigma_y) of a trial stress (m, b, s) beyond the surface, with cross coefficient c."""
    b2 = 3.0 * material.alpha[body] * material.alpha[body]
    off = 0.5 * (1.0 - b2)
    radius = ti.sqrt(off * off + c * c)
    gx, gy = 0.5 * (1.0 + b2) + radius, 0.5 * (1.0 + b2) - radius
    # direction of the larger one: (cos, sin) of half the angle of (off, c)
    cos2 = 0.5 + 0.5 * off / ti.max(radius, 1e-30)
    cos, sin = ti.sqrt(ti.max(cos2, 0.0)), ti.sqrt(ti.max(1.0 - cos2, 0.0))
    if c < 0.0:
        sin = -sin
    m, b = ti.Vector([s[0], s[1], s[2]]), ti.Vector([s[3], s[4], s[5]])
    x, y = cos * m + sin * b, cos * b - sin * m
    x1, x2 = modes(x, x)
    y1, y2 = modes(y, y)
    across = 3.0 * material.kappa[body]
    a = ti.Vector([gx * x1, gx * x2, gy * y1, gy * y2, across * (s[6] * s[6] + s[7] * s[7])])
    k = ti.Vector([bulk * gx, shear * gx, bulk * gy, shear * gy, across * sheared])
    dp, now = multiplier(material, body, a, k, flow, lam, kept, rate_factor)
    d = 1.0 / (1.0 + k * (dp / now))
    xm, xh, ym, yh = 0.5 * d[0] * (x[0] + x[1]), 0.5 * d[1] * (x[0] - x[1]), 0.5 * d[2] * (y[0] + y[1]), 0.5 * d[3] * (y[0] - y[1])
    x = ti.Vector([xm + xh, xm - xh, d[1] * x[2]])
    y = ti.Vector([ym + yh, ym - yh, d[3] * y[2]])
    m, b = cos * x - sin * y, sin * x + cos * y
    return ti.Vector([m[0], m[1], m[2], b[0], b[1], b[2], d[4] * s[6], d[4] * s[7]]), dp, now


@ti.func
def return_section(material: ti.template(), body, s: ti.template(), trial2, bulk, shear, sheared, flow, lam, kept, rate_factor):
    """(returned stress, dp, sigma_y) of a trial stress (m, b, s) beyond the surface, trial2 = sigma_eq^2 of it;
    `sheared` = G_s / e.

    Finds the cross coefficient c: alpha / 2 where that leaves (m, b) > 0, -alpha / 2 where that leaves (m, b) < 0, or
    the one between them that returns to the edge; (m, b) falls as c grows. To first order it falls by
    l (1 + 3 alpha^2) (m, h b) + c l ((m, h m) + (b, h b)); a secant, kept between its bounds, does the rest.
    """
    m, b = ti.Vector([s[0], s[1], s[2]]), ti.Vector([s[3], s[4], s[5]])
    x1, x2 = modes(m, b)
    m1, m2 = modes(m, m)
    b1, b2 = modes(b, b)
    half, part = 0.5 * material.alpha[body], 3.0 * material.alpha[body] * material.alpha[body]
    low, high = -half, half
    slip = (ti.sqrt(trial2) / (rate_factor * flow) - 1.0) * trial2 / (bulk * (m1 + part * part * b1) + shear * (m2 + part * part * b2))
    left = x1 + x2 - slip * (1.0 + part) * (bulk * x1 + shear * x2)
    falls = ti.max(slip * (bulk * (m1 + b1) + shear * (m2 + b2)), 1e-30)
    c = ti.min(ti.max(left / falls, -half), half)
    r, dp, now = s, flow * 0.0, flow
    c_last, left_last = c, left
    going, round = 1, 0
    while going == 1:
        r, dp, now = return_with(material, body, s, c, bulk, shear, sheared, flow, lam, kept, rate_factor)
        m, b = ti.Vector([r[0], r[1], r[2]]), ti.Vector([r[3], r[4], r[5]])
        left = product(m[0], m[1], m[2], b[0], b[1], b[2])
        round += 1
        if ti.abs(left) <= EDGE * now * now or (c >= half and left > 0.0) or (c <= -half and left < 0.0) or round == 40:
            going = 0
        else:
            if left > 0.0:
                low = c
            else:
                high = c
            if round == 1:
                m1, m2 = modes(m, m)
                b1, b2 = modes(b, b)
                falls = ti.max(dp / now * (bulk * (m1 + b1) + shear * (m2 + b2)), 1e-30)
            elif (left_last - left) * (c - c_last) > 0.0:
                falls = (left_last - left) / (c - c_last)
            c_last, left_last = c, left
            c = ti.min(ti.max(c + left / falls, -half), half)  # a bound is tried itself before it is approached
            if c <= low and low > -half or c >= high and high < half or round % 4 == 0:
                c = 0.5 * (low + high)
    # what is left of the edge and of Newton is taken by B.13: exactly onto the surface
    r *= now / ti.sqrt(equivalent2(r, material.alpha[body], material.kappa[body]))
    return r, dp, now
