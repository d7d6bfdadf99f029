"""
What no motion of a task can do, proved for all of them: payloads, durations.

A proof rests on the equations of motion and the limits of the motors alone, not on a search.

"""

from flex_planner.planning.proofs.proof import (
    bound_duration,
    bound_payload,
    find_proof,
    PayloadBound,
    Proof,
    ProofName,
    prove_not_held,
)

__all__ = ['PayloadBound', 'Proof', 'ProofName', 'bound_duration', 'bound_payload', 'find_proof',
           'prove_not_held']
