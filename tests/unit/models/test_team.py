from __future__ import annotations

import contextlib
import io
import os
import unittest

import torch

from augment import Augmentation
from dataset import DataError, read_folder
from team import Team, fork_team
from test_training import WithImages
from train import Batches, Settings


class Teams(WithImages):
    def test_one_alone_changes_nothing(self):
        parameter = torch.nn.Parameter(torch.zeros(2))
        parameter.grad = torch.tensor([1.0, 2.0])
        self.assertEqual(Team().average([parameter], 3.5), 3.5)
        self.assertEqual(parameter.grad.tolist(), [1.0, 2.0])

    def test_two_processes_keep_the_same_weights(self):
        training = self.training("team", "--processes", "2", "--epochs", "4")
        self.assertEqual(training.steps, 4)  # of two batches of 3, of 6 images
        read, write = os.pipe()
        training.team = fork_team(2)
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                training.run()
            last = torch.cat([p.detach().reshape(-1) for p in training.network.parameters()]).double()
            sums = f"{last.sum().item()!r} {last.abs().sum().item()!r}"
            if not training.team.leads:
                os.write(write, sums.encode())
        finally:
            if not training.team.leads:
                os._exit(0)  # the test runner goes on in the leader alone
        os.close(write)
        self.assertEqual(os.read(read, 200).decode(), sums)
        os.close(read)
        self.assertTrue((self.path / "team" / "checkpoint.pt").exists())
        self.assertEqual(self.training("team").step, 4)  # one process goes on from there

    def test_places_in_a_team_have_batches_of_their_own(self):
        samples = read_folder(self.path / "data")
        settings = Settings(width_px=64, height_px=64, batch=3)
        first, second = (Batches(samples, settings, Augmentation(), 0, 4, 0, None, Team(rank, 2)) for rank in (0, 1))
        alone = Batches(samples, settings, Augmentation(), 0, 8, 0)
        self.assertTrue(torch.equal(first[1][0], alone[2][0]))
        self.assertTrue(torch.equal(second[1][0], alone[3][0]))
        self.assertFalse(torch.equal(first[1][0], second[1][0]))

    def test_all_places_have_images_of_the_size_drawn_for_the_step(self):
        samples = read_folder(self.path / "data")
        settings = Settings(width_px=192, height_px=128, size_steps=1, batch=1)
        places = [Batches(samples, settings, Augmentation(), 0, 30, 0, None, Team(rank, 2)) for rank in (0, 1)]
        shapes = [[tuple(batches[step][0].shape[2:]) for step in range(30)] for batches in places]
        self.assertEqual(shapes[0], shapes[1])
        self.assertEqual(set(shapes[0]), {(64, 128), (128, 192), (192, 256)})

    def test_sizes_that_leave_nothing_are_refused(self):
        with self.assertRaisesRegex(DataError, "1 steps of 64 pixels leave nothing of images of 64x64"):
            self.training("small", "--size-steps", "1")


if __name__ == "__main__":
    unittest.main()
