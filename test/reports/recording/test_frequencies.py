"""Natural frequencies along a motion, and their marks in the spectra."""

from __future__ import annotations

from pathlib import Path

from flex_planner.reports.recording import RecordedRequest, report_page
from flex_planner.reports.recording.frequencies import NaturalFrequencies
from flex_planner.reports.recording.spectra import spectrum
import numpy as np
from report_support import Page


def test_natural_frequencies_are_those_of_the_arm_over_its_postures(
        request_of_plan: RecordedRequest) -> None:
    found = NaturalFrequencies.of(request_of_plan)
    assert found is not None
    # as flex-planner arm tells them: pinned links do not feel the payload while joints are locked
    expected = np.array([[18.14] * 2, [18.14] * 2, [72.55] * 2, [72.55] * 2])
    np.testing.assert_allclose(found.locked, expected, atol=5e-3)
    assert (found.free[:, 0] > found.locked[:, 1]).all()
    assert (np.ptp(found.free, axis=1) > 0.05).all()  # they depend on the posture


def test_spectra_peak_at_the_natural_frequencies_with_the_joints_free(
        request_of_plan: RecordedRequest) -> None:
    motion, found = request_of_plan.motion, NaturalFrequencies.of(request_of_plan)
    assert motion is not None
    assert found is not None
    lines, amplitudes = spectrum(motion.times[:-1], motion.coordinates[:-1, 2:])
    for ends in found.free.reshape(2, 4)[:, [0, 3]]:  # pairs that the spectrum cannot tell apart
        near = np.flatnonzero(np.abs(lines - ends.mean()) < 15)
        peaks = lines[near[amplitudes[near].argmax(axis=0)]]
        # a line of the spectrum is 1 Hz wide
        assert (peaks > ends[0] - 1).all()
        assert (peaks < ends[1] + 1).all()


def test_natural_frequencies_are_marked_in_the_spectra_and_named(
        request_of_plan: RecordedRequest) -> None:
    data, found = Page(report_page(request_of_plan)).data, NaturalFrequencies.of(request_of_plan)
    assert found is not None
    marked = {plot['key']: plot['bands'] for plot in data['plots'] if plot['bands']}
    assert marked.keys() == {'modes_spectrum', 'modal_rates_spectrum'}
    for bands in marked.values():
        assert bands['name'] == 'natural frequencies, joints free, over the postures of the motion'
        assert bands['labels'] == ['f1', 'f2', 'f3', 'f4']
        np.testing.assert_allclose(bands['ranges'], found.free, rtol=1e-12)
    (table,) = [table for table in data['tables'] if table['title'].startswith('Natural freq')]
    assert table['columns'] == ['', 'joints free (marked in the spectra)', 'joints locked']
    assert table['rows'][0][2] == '18.14'


def test_rigid_arms_and_failures_have_no_natural_frequencies(trials: Path, failure: Path) -> None:
    for path in (trials, failure):
        request = RecordedRequest.read(path)
        assert NaturalFrequencies.of(request) is None
        assert 'natural frequencies, joints free' not in report_page(request)
