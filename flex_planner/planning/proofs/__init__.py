"""
What no motion of a task can do, proved for all of them: payloads, durations.

A proof rests on the equations of motion and the limits of the motors alone, not on a search.

"""

from flex_planner.planning.proofs.proof import (
    bound_duration,
    bound_payload,
    find_proof,
    is_payload_bounded,
    PayloadBound,
    Proof,
    ProofName,
    prove_not_held,
)
from flex_planner.planning.proofs.short_durations import (
    check_duration,
    find_doubt,
    guess_duration,
)

__all__ = ['PayloadBound', 'Proof', 'ProofName', 'bound_duration', 'bound_payload',
           'check_duration', 'find_doubt', 'find_proof', 'guess_duration',
           'is_payload_bounded', 'prove_not_held']
