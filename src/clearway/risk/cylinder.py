"""Straight courses through upright cylinders: how many cross one, where, and which others they hit.

Traffic that is spread evenly crosses a convex body along a direction in proportion to the area of
its silhouette, and evenly over it. A course is a point and a direction; cylinders stand upright
about the origin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from clearway.frames import FloatArray


@dataclass(frozen=True, slots=True)
class Cylinder:
    """An upright cylinder about the origin."""

    radius_m: float
    half_height_m: float

    def silhouette_m2(self, direction: FloatArray) -> float:
        """Area seen along a unit vector [3]: a rectangle from the side, a disc from above."""
        level, steep = float(np.hypot(direction[0], direction[1])), abs(float(direction[2]))
        side = 4.0 * self.radius_m * self.half_height_m * level
        return side + np.pi * self.radius_m**2 * steep

    def span(self, point_m: FloatArray, direction: FloatArray) -> tuple[float, float] | None:
        """Where along a straight course it is inside, from the point [3]; None where it never is.

        direction: [3], a unit vector.
        """
        x, y, z = (float(value) for value in point_m)
        u, v, w = (float(value) for value in direction)
        across2 = u * u + v * v
        reach2 = x * x + y * y - self.radius_m**2
        if across2 < 1e-12:
            if reach2 > 0.0:
                return None
            near, far = -np.inf, np.inf
        else:
            half = x * u + y * v
            root2 = half * half - across2 * reach2
            if root2 < 0.0:
                return None
            root = float(np.sqrt(root2))
            near, far = (-half - root) / across2, (-half + root) / across2
        if abs(w) < 1e-12:
            return (near, far) if abs(z) <= self.half_height_m else None
        ends = ((-self.half_height_m - z) / w, (self.half_height_m - z) / w)
        near, far = max(near, min(ends)), min(far, max(ends))
        return (near, far) if near < far else None

    def crossing(self, direction: FloatArray, rng: np.random.Generator) -> FloatArray:
        """[3] where a course of that direction enters, drawn evenly over the silhouette."""
        level, steep = float(np.hypot(direction[0], direction[1])), abs(float(direction[2]))
        side = 4.0 * self.radius_m * self.half_height_m * level
        if rng.random() * self.silhouette_m2(direction) < side:
            off = self.radius_m * rng.uniform(-1.0, 1.0)
            back = -np.sqrt(self.radius_m**2 - off**2)
            ahead = direction[:2] / level
            aside = np.array([-ahead[1], ahead[0]])
            x, y = back * ahead + off * aside
            return np.array([x, y, self.half_height_m * rng.uniform(-1.0, 1.0)])
        radius, angle = self.radius_m * np.sqrt(rng.random()), 2.0 * np.pi * rng.random()
        end = -np.sign(direction[2]) * self.half_height_m if steep else 0.0
        return np.array([radius * np.cos(angle), radius * np.sin(angle), end])


@dataclass(frozen=True, slots=True)
class Shells:
    """Cylinders one inside the other; courses into the inner ones are drawn more often.

    A course is drawn through one of the cylinders, chosen with its share. Its likelihood, per
    area across the direction, is then the sum of share / silhouette over the cylinders that it
    hits; courses of evenly spread traffic all have the same one, so 1 / likelihood is the weight
    that makes up for it. With a share above 0 of the outer one no weight exceeds its silhouette
    by more than 1 / share.
    """

    cylinders: tuple[Cylinder, ...]
    """The outer one first."""
    shares: tuple[float, ...]
    """Of the courses drawn, adding up to 1."""

    def draw(self, direction: FloatArray, rng: np.random.Generator) -> tuple[FloatArray, float]:
        """Where a course [3] enters the outer cylinder, and its weight in square metres."""
        chosen = int(rng.choice(len(self.cylinders), p=self.shares))
        point = self.cylinders[chosen].crossing(direction, rng)
        inside = self.cylinders[0].span(point, direction)
        # Rounding may put a point of the rim itself outside.
        entry = point if inside is None else point + inside[0] * direction
        return entry, self.weight_m2(entry, direction, chosen)

    def weight_m2(self, point_m: FloatArray, direction: FloatArray, through: int = 0) -> float:
        """Of a course through a point [3]; `through`: a cylinder that it is known to hit."""
        likelihood = sum(
            share / cylinder.silhouette_m2(direction)
            for index, (cylinder, share) in enumerate(zip(self.cylinders, self.shares, strict=True))
            if index in (0, through) or cylinder.span(point_m, direction) is not None
        )
        return 1.0 / likelihood
