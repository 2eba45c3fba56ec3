"""Two regressions in numpy: a small network, and a kernel ridge regression."""

import numpy as np


def network(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """A network with a hidden layer of 32 tanh units, trained by Adam with weight decay."""
    rng, size = np.random.default_rng(1), y.std()
    parts = [rng.normal(size=(x.shape[1], 32)) / x.shape[1] ** 0.5, np.zeros(32), np.zeros((32, y.shape[1]))]
    mean, square = [[np.zeros_like(one) for one in parts] for _ in range(2)]
    for step in range(1, 2001):
        inner = np.tanh(x @ parts[0] + parts[1])
        off = (inner @ parts[2] - y / size) / len(x)
        back = off @ parts[2].T * (1 - inner**2)
        for i, slope in enumerate((x.T @ back, back.sum(axis=0), inner.T @ off)):
            slope = slope + 1e-4 * parts[i]
            mean[i] += 0.1 * (slope - mean[i])
            square[i] += 0.001 * (slope**2 - square[i])
            parts[i] -= 0.01 * mean[i] / (1 - 0.9**step) / ((square[i] / (1 - 0.999**step)) ** 0.5 + 1e-8)
    return size * np.tanh(at @ parts[0] + parts[1]) @ parts[2]


def kernel(x: np.ndarray, y: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Ridge regression with the kernel ``(1 + x.x')^2``; the penalty is chosen by leave-one-out cross-validation."""
    own, tried = (1 + x @ x.T) ** 2, {}
    for weight in 10.0 ** np.arange(-6, 3):
        inverse = np.linalg.inv(own + weight * np.eye(len(x)))
        tried[np.linalg.norm(inverse @ y / np.diag(inverse)[:, None])] = inverse
    return (1 + at @ x.T) ** 2 @ tried[min(tried)] @ y
