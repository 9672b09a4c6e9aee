"""Formulas as Drake Systems that go together with continuous states.

Drake's SymbolicVectorSystem ends the process if it has no continuous state while another system of its diagram has one:
asked for time derivatives, as every system of such a diagram is, it demands to have some. So here it only computes,
inside of a system that has none.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from pydrake.symbolic import Expression, Variable
from pydrake.systems.framework import BasicVector_, EventStatus, LeafSystem_
from pydrake.systems.primitives import SymbolicVectorSystem
from pydrake.systems.scalar_conversion import TemplateSystem


class Formula:
    """A vector of expressions of a vector of variables, evaluated by Drake in one scalar type."""

    def __init__(self, source: SymbolicVectorSystem, T: Any) -> None:
        """Takes what `_formula` makes."""
        self._system = source if T is float else source.ToScalarType[T]()
        self._port = self._system.get_output_port()
        self._context = self._system.CreateDefaultContext()

    def __call__(self, values: Any) -> Any:
        """The expressions at values of the variables."""
        self._context.SetDiscreteState(values)
        return self._port.Eval(self._context)


@TemplateSystem.define("SymbolicBlock_")  # type: ignore[untyped-decorator]
def SymbolicBlock_(T: Any) -> Any:
    """For a scalar type, the class of systems that compute formulas (see `symbolic_block`)."""

    class Impl(LeafSystem_[T]):
        def _construct(
            self,
            output: SymbolicVectorSystem | None,
            update: SymbolicVectorSystem | None,
            sizes: tuple[int, int],
            period: float,
            *,
            feedthrough: bool,
            converter: Any = None,
        ) -> None:
            LeafSystem_[T].__init__(self, converter=converter)
            self._arguments = output, update, sizes, period, feedthrough
            inputs, states = sizes
            self._input = self.DeclareVectorInputPort("u0", BasicVector_[T](inputs))
            if states:
                index = self.DeclareDiscreteState(states)
                self._update = Formula(update, T)
                self.DeclarePeriodicDiscreteUpdateEvent(period, 0.0, self._next_state)
            if output is None:
                self.DeclareStateOutputPort("y0", index)
                return
            self._output = Formula(output, T)
            tickets = {self.all_sources_ticket() if feedthrough else self.xd_ticket()}
            size = output.get_output_port().size()
            self.DeclareVectorOutputPort("y0", BasicVector_[T](size), self._calc_output, tickets)

        def _construct_copy(self, other: Any, converter: Any = None) -> None:
            *arguments, feedthrough = other._arguments
            Impl._construct(self, *arguments, feedthrough=feedthrough, converter=converter)

        def _variables(self, context: Any, *, with_input: bool) -> Any:
            inputs, states = self._arguments[2]
            values = self._input.Eval(context) if with_input else np.zeros(inputs)
            return np.concatenate([context.get_discrete_state(0).CopyToVector(), values]) if states else values

        def _calc_output(self, context: Any, output: Any) -> None:
            output.SetFromVector(self._output(self._variables(context, with_input=self._arguments[-1])))

        def _next_state(self, context: Any, state: Any) -> EventStatus:
            state.get_mutable_vector(0).SetFromVector(self._update(self._variables(context, with_input=True)))
            return EventStatus.Succeeded()

    return Impl


def symbolic_block(
    *,
    input: Sequence[Variable],
    output: Sequence[Variable | Expression],
    state: Sequence[Variable] = (),
    dynamics: Sequence[Variable | Expression] = (),
    time_period: float = 0.0,
) -> Any:
    """A System whose outputs are formulas of its input, and if it has a time_period, of a discrete state.

    Converts to AutoDiffXd and Expression. Ports as of Drake's SymbolicVectorSystem, whose arguments these are.
    """
    variables = [*state, *input]
    outputs: list[Expression] = [1.0 * each for each in output]
    used = {variable.get_id() for each in outputs for variable in each.GetVariables()}
    is_state = len(outputs) == len(state) and all(a.EqualTo(1.0 * b) for a, b in zip(outputs, state, strict=True))
    return SymbolicBlock_[None](
        None if is_state else _formula(variables, outputs),
        _formula(variables, dynamics) if state else None,
        (len(input), len(state)),
        time_period,
        feedthrough=any(variable.get_id() in used for variable in input),
    )


def variables(name: str, count: int) -> list[Variable]:
    """Variables by a name and their number."""
    return [Variable(f"{name}_{index}") for index in range(count)]


def _formula(variables: Sequence[Variable], expressions: Sequence[Variable | Expression]) -> SymbolicVectorSystem:
    """The expressions of the variables, which are a state: that is set three times as fast as an input."""
    return SymbolicVectorSystem(
        state=list(variables),
        dynamics=[1.0 * each for each in variables],
        output=[1.0 * each for each in expressions],
        time_period=1.0,
    )
