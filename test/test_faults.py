"""What the simulated camera sends of each shot, under each fault."""

from collections import Counter
from pathlib import Path

from active_recon.errors import ConfigError
from active_recon.geometry.cameras import azimuth_difference, orbit_camera
from active_recon.simulation.faults import CameraFaults, FAULTS, read_faults, Shot
import numpy as np
import pytest

PERIOD = 0.1
SHOTS = 400
IMAGE = np.zeros((2, 2, 3), np.uint8)


def shot(index):
    return Shot(index, IMAGE, orbit_camera(1.0))


def stream(*entries, seed=0, shots=SHOTS):
    """Return what is sent shot by shot, each stamped with its number."""
    faults = CameraFaults(read_faults(entries), seed)
    return [faults.sent(shot(index), index * PERIOD) for index in range(shots)]


def stamps(sent, part):
    return [each.shot.stamp for at_once in sent for each in at_once if each.part == part]


def test_without_faults_each_shot_is_sent_whole_the_image_last():
    for index, sent in enumerate(stream()):
        assert [each.part for each in sent] == ['pose', 'camera_info', 'image']
        assert all(each.shot.stamp == index and each.kept == 1 for each in sent)
        assert all(each.shot.camera.pose is sent[0].shot.camera.pose for each in sent)


@pytest.mark.parametrize(('fault', 'part'), [
    ('drop_images', 'image'), ('drop_camera_info', 'camera_info'), ('drop_poses', 'pose')])
def test_that_share_of_one_part_is_not_sent_and_the_rest_is(fault, part):
    sent = stream(f'{fault}:0.3')
    assert len(stamps(sent, part)) == pytest.approx(0.7 * SHOTS, abs=0.08 * SHOTS)
    for other in {'image', 'camera_info', 'pose'} - {part}:
        assert stamps(sent, other) == list(range(SHOTS))
    assert not stamps(stream(f'{fault}:1'), part)


def test_a_delayed_image_comes_that_much_after_its_pose_and_in_order():
    sent = stream('delay_images:0.25')
    assert [stamps([at_once], 'image') for at_once in sent[:5]] == [[], [], [], [0], [1]]
    assert stamps(sent, 'pose') == list(range(SHOTS))


def test_an_image_that_was_delayed_still_comes_when_the_fault_is_over():
    faults = CameraFaults({'delay_images': 0.25})
    assert not stamps([faults.sent(shot(0), 0.0)], 'image')
    faults.change({})
    assert stamps([faults.sent(shot(1), 0.1), faults.sent(shot(2), 0.3)], 'image') == [0, 1, 2]


@pytest.mark.parametrize('entry', ['delay_images:0.25', 'reorder_images:1'])
def test_after_the_clock_went_back_images_come_as_if_the_camera_had_just_begun(entry):
    faults = CameraFaults(read_faults([entry]))
    before = [faults.sent(shot(1000 + index), 100 + index * PERIOD) for index in range(5)]
    assert len(stamps(before, 'image')) < 5
    after = [faults.sent(shot(index), index * PERIOD) for index in range(SHOTS)]
    assert stamps(after, 'image') == stamps(stream(entry), 'image')


def test_that_share_of_the_images_is_sent_twice():
    counts = Counter(stamps(stream('duplicate_images:0.3'), 'image'))
    assert counts.keys() == set(range(SHOTS))
    assert sum(count == 2 for count in counts.values()) == pytest.approx(0.3 * SHOTS, abs=32)


def test_images_out_of_order_are_all_sent_each_at_most_one_late():
    heard = stamps(stream('reorder_images:0.3'), 'image')
    assert sorted(heard) == list(range(len(heard)))
    assert len(heard) >= SHOTS - 1
    late = [a for a, b in zip(heard, heard[1:], strict=False) if b < a]
    assert len(late) > 0.15 * SHOTS
    assert all(abs(stamp - place) <= 1 for place, stamp in enumerate(heard))


def test_that_share_of_the_images_is_cut_short():
    kept = [each.kept for at_once in stream('corrupt_images:0.3') for each in at_once]
    assert sum(share < 1 for share in kept) == pytest.approx(0.3 * SHOTS, abs=32)
    assert min(kept) >= 0


def test_that_share_of_the_camera_infos_is_of_another_size_and_the_image_is_as_it_was():
    sent = [each for at_once in stream('wrong_camera_info:0.3') for each in at_once]
    wrong = [each for each in sent if each.shot.camera.intrinsics.width != 137]
    assert len(wrong) == pytest.approx(0.3 * SHOTS, abs=32)
    assert all(each.part == 'camera_info' for each in wrong)


def test_pose_noise_has_that_deviation_in_azimuth_and_leaves_height_and_distance():
    poses = [each.shot.camera for at_once in stream('pose_noise:0.05')
             for each in at_once if each.part == 'pose']
    away = azimuth_difference([camera.azimuth for camera in poses], 1.0)
    assert np.std(away) == pytest.approx(0.05, rel=0.15)
    assert np.mean(away) == pytest.approx(0, abs=0.01)
    still = orbit_camera(1.0)
    for camera in poses:
        assert camera.elevation == pytest.approx(still.elevation)
        assert camera.distance == pytest.approx(still.distance)
        np.testing.assert_allclose(
            camera.pose, orbit_camera(camera.azimuth).pose, atol=1e-9)


def test_a_motor_that_stalls_always_stands_from_then_on_until_the_fault_is_over():
    faults = CameraFaults({})
    before = [faults.motor_time(now) for now in np.arange(10.0, 12.0, PERIOD)]
    np.testing.assert_allclose(before, np.arange(10.0, 12.0, PERIOD))
    faults.change({'stall_motor': 1.0})
    stalled = {round(faults.motor_time(now), 6) for now in np.arange(12.0, 15.0, PERIOD)}
    assert stalled == {11.9}
    faults.change({})
    assert faults.motor_time(15.1) - faults.motor_time(15.0) == pytest.approx(0.1)


def test_a_motor_stands_for_that_share_of_the_seconds_and_never_runs_backwards():
    faults = CameraFaults({'stall_motor': 0.3})
    times = [faults.motor_time(now) for now in np.arange(0.0, 400.0, PERIOD)]
    assert min(np.diff(times)) >= 0
    assert times[-1] == pytest.approx(0.7 * 400, abs=32)


def test_a_camera_that_restarts_is_gone_for_whole_seconds_and_loses_what_it_held():
    faults = CameraFaults({'restart': 0.3, 'delay_images': 0.5})
    seconds = [{faults.is_there(second + later) for later in (0.0, 0.4, 0.9)}
               for second in range(SHOTS)]
    assert all(len(states) == 1 for states in seconds)
    assert sum(states == {False} for states in seconds) == pytest.approx(0.3 * SHOTS, abs=32)
    faults.change({'delay_images': 0.5})
    faults.sent(shot(0), SHOTS)
    faults.change({'restart': 1.0})
    assert not faults.is_there(SHOTS + 0.1)
    faults.change({})
    assert stamps([faults.sent(shot(1), SHOTS + 1.0)], 'image') == [1]


def test_the_same_seed_gives_the_same_stream_and_another_one_another():
    entries = [f'{name}:0.2' for name in FAULTS]

    def sent(seed):
        return [(each.part, each.shot.stamp, each.kept)
                for at_once in stream(*entries, seed=seed) for each in at_once]

    assert sent(1) == sent(1)
    assert sent(1) != sent(2)


@pytest.mark.parametrize(('entries', 'said'), [
    (['drop_pictures:0.3'], "unknown fault: expected NAME:AMOUNT with a name of drop_images, .*, "
                            "got 'drop_pictures:0.3'"),
    (['drop_images'], "wrong amount of drop_images: expected a number from 0 to 1 .*, got "
                      "'drop_images'"),
    (['drop_images:30%'], "number from 0 to 1 .*, got 'drop_images:30%'"),
    (['drop_images:1.1'], "number from 0 to 1 .*, got 'drop_images:1.1'"),
    (['delay_images:-1'], "number from 0 to 10 .*, got 'delay_images:-1'"),
    (['pose_noise:nan'], "number from 0 to 3.14.*, got 'pose_noise:nan'"),
    (['restart:0.1', 'restart:0.2'], "restart given twice: expected it once, got it again: "
                                     "'restart:0.2'"),
])
def test_a_fault_that_cannot_be_is_refused_with_the_reason(entries, said):
    with pytest.raises(ConfigError, match=said) as refused:
        read_faults(entries)
    assert refused.value.kind == 'faults'


def test_faults_are_read_and_empty_entries_passed_by():
    assert read_faults(['drop_images:0.3', '', 'pose_noise:1e-2']) == {
        'drop_images': 0.3, 'pose_noise': 0.01}


def test_the_documentation_has_a_row_for_each_fault_and_for_no_other():
    page = (Path(__file__).parents[1] / 'doc/diagnostics.md').read_text()
    table = page.split('| fault |')[1].split('\n\n')[0]
    assert [row.split('`')[1] for row in table.splitlines()[2:]] == list(FAULTS)
