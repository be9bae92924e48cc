"""A small neural network of tanh layers in NumPy: outputs, gradients, the optimiser Adam, and saving to a file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.floating]

#: Normalised inputs are clipped to this many standard deviations from the mean.
CLIP_DEVIATIONS = 10.0


class Network:
    """Fully connected layers, tanh between them, the last one linear."""

    def __init__(self, sizes: tuple[int, ...], rng: np.random.Generator, last_scale: float) -> None:
        self.weights: list[Floats] = []
        self.biases: list[Floats] = []
        for index, (inputs, outputs) in enumerate(zip(sizes, sizes[1:])):
            scale = last_scale if index == len(sizes) - 2 else 1.0
            self.weights.append(scale * orthogonal(inputs, outputs, rng))
            self.biases.append(np.zeros(outputs, np.float32))

    def __call__(self, inputs: Floats) -> Floats:
        """Outputs (n, outputs) for inputs (n, inputs)."""
        return self.layers(inputs)[-1]

    def layers(self, inputs: Floats) -> list[Floats]:
        """The inputs and the output of each layer, the argument of :meth:`gradients`."""
        values = [inputs]
        for weight, bias in zip(self.weights[:-1], self.biases[:-1]):
            values.append(np.tanh(values[-1] @ weight + bias))
        values.append(values[-1] @ self.weights[-1] + self.biases[-1])
        return values

    def gradients(self, values: list[Floats], output_gradient: Floats) -> list[Floats]:
        """Gradients of a loss by each of :meth:`parameters`.

        `values` is the result of :meth:`layers`, `output_gradient` the gradient of the loss by the outputs.
        """
        gradients: list[Floats] = []
        gradient = output_gradient
        for index in reversed(range(len(self.weights))):
            gradients += [gradient.sum(axis=0), values[index].T @ gradient]
            if index > 0:
                gradient = (gradient @ self.weights[index].T) * (1.0 - values[index] ** 2)
        return gradients[::-1]

    def parameters(self) -> list[Floats]:
        """Weight and bias of each layer, first layer first; changed in place by :class:`Adam`."""
        return [part for layer in zip(self.weights, self.biases) for part in layer]


def orthogonal(inputs: int, outputs: int, rng: np.random.Generator) -> Floats:
    """A random matrix (inputs, outputs) whose rows or columns, whichever are fewer, are orthonormal."""
    random = rng.standard_normal((max(inputs, outputs), min(inputs, outputs)))
    q, r = np.linalg.qr(random)
    q = q * np.sign(np.diag(r))
    return (q if inputs >= outputs else q.T).astype(np.float32)


class Adam:
    """The optimiser of Kingma and Ba, with a limit on the gradient's norm."""

    def __init__(self, parameters: list[Floats], max_norm: float) -> None:
        self._parameters = parameters
        self._max_norm = max_norm
        # Running means of the gradients and of their squares.
        self._means = [np.zeros_like(parameter) for parameter in parameters]
        self._squares = [np.zeros_like(parameter) for parameter in parameters]
        self._steps = 0

    def step(self, gradients: list[Floats], learning_rate: float) -> None:
        """Moves the parameters against the gradients."""
        self._steps += 1
        norm = float(np.sqrt(sum(float(np.vdot(gradient, gradient)) for gradient in gradients)))
        scale = min(1.0, self._max_norm / (norm + 1e-8))
        corrected_rate = learning_rate * np.sqrt(1.0 - 0.999**self._steps) / (1.0 - 0.9**self._steps)
        for parameter, mean, square, gradient in zip(
            self._parameters, self._means, self._squares, gradients
        ):
            gradient = scale * gradient
            mean += 0.1 * (gradient - mean)
            square += 0.001 * (gradient * gradient - square)
            parameter -= np.float32(corrected_rate) * mean / (np.sqrt(square) + 1e-8)


class Normalisation:
    """Running mean and variance of a network's input."""

    def __init__(self, length: int) -> None:
        self.count = 1e-4
        self.mean = np.zeros(length)
        self.variance = np.ones(length)

    def update(self, samples: npt.NDArray[np.floating]) -> None:
        """Adds samples (n, length)."""
        count = len(samples)
        total = self.count + count
        delta = samples.mean(axis=0) - self.mean
        spread = self.variance * self.count + samples.var(axis=0) * count
        self.variance = (spread + delta**2 * self.count * count / total) / total
        self.mean = self.mean + delta * count / total
        self.count = total

    def __call__(self, inputs: npt.NDArray[np.floating]) -> Floats:
        """The inputs in standard deviations from the mean, clipped to ±CLIP_DEVIATIONS."""
        scaled = (inputs - self.mean) / np.sqrt(self.variance + 1e-8)
        return np.clip(scaled, -CLIP_DEVIATIONS, CLIP_DEVIATIONS).astype(np.float32)


def save(path: Path, network: Network, normalisation: Normalisation) -> None:
    """Writes a policy: weights, biases, and the normalisation of its input."""
    parts = {f"weight{index}": weight for index, weight in enumerate(network.weights)}
    parts |= {f"bias{index}": bias for index, bias in enumerate(network.biases)}
    deviation = np.sqrt(normalisation.variance + 1e-8)
    parts |= {"mean": normalisation.mean.astype(np.float32), "deviation": deviation.astype(np.float32)}
    np.savez(path, **parts)  # type: ignore[arg-type]


class SavedPolicy:
    """A policy from a file of :func:`save`."""

    def __init__(self, path: Path) -> None:
        with np.load(path) as file:
            self.parts: dict[str, Floats] = {name: file[name] for name in file.files}
        self.layers = sum(name.startswith("weight") for name in self.parts)

    def __call__(self, inputs: Floats) -> Floats:
        """Actions (n, outputs) for inputs (n, inputs)."""
        parts = self.parts
        value = np.clip((inputs - parts["mean"]) / parts["deviation"], -CLIP_DEVIATIONS, CLIP_DEVIATIONS)
        for index in range(self.layers - 1):
            value = np.tanh(value @ parts[f"weight{index}"] + parts[f"bias{index}"])
        actions: Floats = value @ parts[f"weight{self.layers - 1}"] + parts[f"bias{self.layers - 1}"]
        return actions
