"""The price of accuracy: one scene, its knobs turned one at a time, error against cost.

Cost: processor seconds of the time loop, of which other programs on the machine take no part, and free of the machine
node-steps and bytes of fields. Points are compared by processor seconds; where the scene as it is takes less than LEAST of
them, loading and compiling the kernels is much of it, and node-steps compare (not of a scene that asks for equilibrium, where a step is as
long as Newton's method takes). Error of a point: the largest over the judged quantities of

    |value - reference| / |reference|

with the reference the target of the quantity (closed form, experiment), else the value that the spacings tend to
(Richardson: v(D) = v* + C D^p through the three finest, where they converge monotonically with 0.3 < p < 6), else the
finest run. Judged are the quantities with a target of their own, or those that are asked for. Those with a tolerance of 0,
counts, must come out: a point where one does not is another answer, not a worse number, and has no error.

Rupture is sensitive: the scene as it is and every point that no other one beats are run again with their nodes moved at
random, and the error of such a point is the mean over its runs, with the smallest and the largest beside it.

Qualities by rule (`QUALITY_RULE`), from the points that no other one beats in both error and cost.
"""
