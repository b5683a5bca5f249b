"""Symmetric positive definite banded systems, solved by cyclic reduction over blocks.

A band of half-width K is block tridiagonal in blocks of K rows. Cyclic reduction takes every other block out at once,
which leaves a block tridiagonal system of half the size (Golub and Van Loan 2013, "Matrix Computations", 4th edition,
section 4.5): a few rounds of array operations instead of one for each row. The blocks run along the last axis.
"""

from __future__ import annotations

import numpy as np

from .arrays import Array

_DENSE = 24
"""Blocks from which on down a dense solution is quicker than more rounds."""


def solve_banded(band: Array, right: Array) -> Array:
    """Solve a symmetric positive definite banded system.

    Parameters
    ----------
    band : (K + 1, N) float array
        band[k, i] is the matrix element (i, i + k), K at least 1.
    right : (N, C) float array
        Right-hand sides.

    Returns
    -------
    (N, C) float array

    Examples
    --------
    >>> solve_banded(np.array([[2.0, 2.0, 2.0], [-1.0, -1.0, 0.0]]), np.array([[1.0], [0.0], [1.0]])).round(9)
    array([[1.],
           [1.],
           [1.]])
    """
    size, count = len(band) - 1, band.shape[1]
    blocks = -(-count // size)
    padded = np.zeros((size + 1, blocks * size))
    padded[:, :count] = band
    padded[0, count:] = 1.0
    diagonal = np.zeros((size, size, blocks))
    coupling = np.zeros((size, size, blocks - 1))  # from each block's rows to the next block's columns
    for k in range(size + 1):
        elements = padded[k].reshape(blocks, size).T
        for row in range(size):
            if row + k < size:
                diagonal[row, row + k] = diagonal[row + k, row] = elements[row]
            else:
                coupling[row, row + k - size] = elements[row, :-1]
    unknown = np.zeros((blocks * size, right.shape[1]))
    unknown[:count] = right
    unknown = np.ascontiguousarray(unknown.reshape(blocks, size, -1).transpose(1, 2, 0))
    return _reduce(diagonal, coupling, unknown).transpose(2, 0, 1).reshape(blocks * size, -1)[:count]


def _reduce(diagonal: Array, coupling: Array, right: Array) -> Array:
    """Solve D[i]·x[i] + U[i]·x[i+1] + U[i-1]ᵀ·x[i-1] = r[i] for blocks i along the last axis."""
    size, columns, blocks = right.shape
    if blocks <= _DENSE:
        whole, row = np.zeros((blocks, size, blocks, size)), np.arange(blocks)
        whole[row, :, row] = diagonal.transpose(2, 0, 1)
        whole[row[:-1], :, row[1:]], whole[row[1:], :, row[:-1]] = (
            coupling.transpose(2, 0, 1),
            coupling.transpose(2, 1, 0),
        )
        flat = right.transpose(2, 0, 1).reshape(blocks * size, columns)
        return (
            np.linalg.solve(whole.reshape(2 * flat.shape[:1]), flat).reshape(blocks, size, columns).transpose(1, 2, 0)
        )
    odd, last = blocks // 2, (blocks - 1) // 2  # odd blocks; those of them that have a block after them
    # Each odd block as a function of its even neighbours: x = constant - from_before·x[i-1] - from_after·x[i+1].
    sides = np.zeros((size, 2 * size + columns, odd))
    sides[:, :size] = coupling[..., ::2].swapaxes(0, 1)
    sides[:, size : 2 * size, :last] = coupling[..., 1::2]
    sides[:, 2 * size :] = right[..., 1::2]
    eliminated = _eliminate(diagonal[..., 1::2], sides)
    even = _reduce(*_without_odd(diagonal, coupling, right, eliminated))

    from_before, from_after, constant = np.split(eliminated, (size, 2 * size), axis=1)
    solution = np.empty_like(right)
    solution[..., ::2] = even
    solution[..., 1::2] = constant - _product(from_before, even[..., :odd])
    solution[..., 1 : 2 * last : 2] -= _product(from_after[..., :last], even[..., 1:])
    return solution


def _without_odd(diagonal: Array, coupling: Array, right: Array, eliminated: Array) -> tuple[Array, Array, Array]:
    """The system of the even blocks alone: its diagonal, coupling and right side."""
    size, odd, last = len(diagonal), eliminated.shape[-1], coupling[..., 1::2].shape[-1]
    diagonal, right = diagonal[..., ::2].copy(), right[..., ::2].copy()
    forward = _product(coupling[..., ::2], eliminated)
    diagonal[..., :odd] -= forward[:, :size]
    right[..., :odd] -= forward[:, 2 * size :]
    backward = _product(coupling[..., 1::2].swapaxes(0, 1), eliminated[:, size:, :last])
    diagonal[..., 1:] -= backward[:, :size]
    right[..., 1:] -= backward[:, size:]
    return diagonal, -forward[:, size : 2 * size, :last], right


def _eliminate(matrix: Array, right: Array) -> Array:
    """Solve (K, K, M) matrices for (K, C, M) right sides, in place of these; definite ones need no pivots."""
    matrix, solution = matrix.copy(), right
    size = len(matrix)
    for i in range(size):
        factor = matrix[i + 1 :, i] / matrix[i, i]
        matrix[i + 1 :, i + 1 :] -= factor[:, None] * matrix[i, i + 1 :]
        solution[i + 1 :] -= factor[:, None] * solution[i]
    for i in reversed(range(size)):
        for j in range(i + 1, size):
            solution[i] -= matrix[i, j] * solution[j]
        solution[i] /= matrix[i, i]
    return solution


def _product(matrix: Array, right: Array) -> Array:
    """Matrix products of (K, K, M) and (K, C, M)."""
    product: Array = matrix[:, 0, None] * right[0]
    for j in range(1, len(right)):
        product += matrix[:, j, None] * right[j]
    return product
