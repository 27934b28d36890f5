"""Complex expressions, for optical constants."""

from __future__ import annotations

from dataclasses import dataclass

from clbrdf.models.expression import Expression
from clbrdf.models.fresnel import complex_root


@dataclass(frozen=True)
class Complex:
    """re + i im."""

    re: Expression
    im: Expression

    def __add__(self, other: Complex | Expression) -> Complex:
        if isinstance(other, Complex):
            return Complex(self.re + other.re, self.im + other.im)
        return Complex(self.re + other, self.im)

    def __sub__(self, other: Expression | float) -> Complex:
        return Complex(self.re - other, self.im)

    def __mul__(self, other: Complex | Expression) -> Complex:
        if isinstance(other, Complex):
            re = self.re * other.re - self.im * other.im
            return Complex(re, self.re * other.im + self.im * other.re)
        return Complex(self.re * other, self.im * other)

    def square(self) -> Expression:
        """|z|²."""
        return self.re**2 + self.im**2


def root(z: Complex) -> Complex:
    """Square root with a real part that is not negative, for im ≥ 0."""
    return Complex(*complex_root(z.re, z.im))
