"""Random scenes in which `rockcheck stress` once found a fault, by what is special in them; each keeps all invariants now."""

from __future__ import annotations

import pytest

from rockcheck.validation.stress.players import PLAYERS

#: The fault, the model, the seed of the random scenes and the scene's number.
FOUND = [
    ("hangs as the floor falls away, beside a wall", "ebm", 21, 196),
    ("hangs as the floor falls away, pressed on a wall", "ebm", 21, 905),
    ("hangs as the floor falls away, between two walls", "ebm", 21, 900),
    ("hangs wedged between two walls", "ebm", 21, 4819),
    ("meets both walls at once", "ebm", 21, 1704),
    ("meets both walls at once, squat", "ebm", 21, 3936),
    ("hangs by a tie that the mirror image breaks alike", "ebm", 22, 157),
    ("slip turns as the far gap closes", "ebm", 23, 2373),
    ("slip turns as the far gap closes, static friction above kinetic", "ebm", 23, 4029),
    ("rattles between walls that hardly leave room", "ebm", 23, 10464),
    ("gravity vanishes under spikes of vertical motion, on the far wall", "ebm", 23, 19271),
    ("slips at Painleve's limit, hanging", "ebm", 24, 752),
    ("slips at Painleve's limit, under a strong pulse", "ebm", 24, 24325),
    ("starts with slip at Painleve's limit", "ebm", 24, 3847),
    ("rests without friction as gravity vanishes", "ebm", 24, 19696),
    ("rests without friction on a wall as gravity vanishes", "ebm", 24, 24893),
    ("bounces a hundred thousand times between two walls", "ebm", 42, 5891),
    ("hangs where it has rocked back to", "ebm", 1, 23263),
    ("leaves rest in a step so long that its guard was noise at first", "ebm", 1, 71018),
    ("a tiny motion that grows", "ebm", 1, 94890),
    ("a slipping pivot near Painleve's limit, from which all starts lead to one motion, and that to many", "ebm", 1, 29170),
    ("integrals that are less exact than they seem", "ebm", 43, 920),
    ("gravity passes zero some thousand times a second, beside a wall", "ebm", 6, 45421),
    ("integrals that are less exact than they seem, by two rules", "ebm", 4, 34770),
    ("hangs where it has rocked back to, without slip", "ebm no-slip", 1, 8417),
    ("swings back to just where it started to hang", "ebm no-slip", 1, 71160),
    ("slips as its far gap is closed but for rounding", "ebm", 2, 31813),
    ("slips away from a wall that it touches", "ebm", 2, 85729),
    ("base acceleration and gravity vanish at one instant", "ebm", 3, 16791),
    ("swings back, gently, to where it started to hang", "ebm no-slip", 3, 97483),
    ("rocks by less than its tolerance where it hangs", "ebm no-slip", 1, 14446),
    ("leans on a far wall with hardly an arm", "ebm no-slip", 2, 34414),
    ("hangs on the corner it stood on, no walls", "ebm no-slip", 2, 3342),
    ("strikes the wall so often that its pivot crept", "ebm no-slip", 31, 514),
    ("lands and hangs at once", "ebm no-slip", 41, 3687),
    ("lands flat with slip", "ebm-unilateral", 12, 120),
    ("lands flat beside a wall", "ebm-unilateral", 22, 1193),
    ("flies between walls that leave no room", "ebm-unilateral", 23, 10166),
    ("leaves a wall in flight as the base acceleration turns", "ebm-unilateral", 23, 115),
    ("turns over in one long step of flight", "ebm-unilateral", 31, 222),
    ("restitution cut so that no energy is gained", "ebm-unilateral", 31, 2079),
    ("rocks flush with the far wall", "ebm-unilateral", 41, 2537),
    ("walls nearer to each other than what counts as flush", "ebm-unilateral", 1, 16952),
    ("on its balance point under vertical motion, of which only the floor's force knows", "ebm-unilateral", 2, 14172),
    ("a wall's push and its gap that are both noise", "ebm-unilateral", 4, 36001),
    ("a wall's pull that is more than noise, and its gap that is less", "ebm-unilateral", 9, 42185),
    ("a wall's push and its gap that both end, but for noise", "ebm-unilateral", 10, 34165),
    ("a corner of its side strikes the wall, then the other, and so on at one instant", "ebm-bouc-wen", 4, 2570),
    ("hangs at once and lands before the next row", "ebm no-slip", 5, 87067),
    ("hangs for an instant between two rows", "ebm no-slip", 9, 87014),
    ("hangs by a tie, and bounces more often than its mirror image", "ebm no-slip", 9, 75684),
    ("bounces so often that rounding is all that tells", "ebm-bouc-wen", 8, 43254),
    ("slides at a wall just before gravity vanishes", "ebm-bouc-wen", 5, 17331),
    ("its friction spring under a force of many weights", "ebm-bouc-wen", 5, 64950),
    ("hangs", "ebm-bouc-wen", 25, 862),
    ("hangs pressed on a wall as gravity passes zero", "ebm-bouc-wen", 25, 1326),
    ("wedged between walls, held by its friction", "ebm-bouc-wen", 25, 1393),
    ("leaves a wall on which it hangs", "ebm-bouc-wen", 25, 2067),
    ("friction is the slope of the block", "ebm-bouc-wen", 26, 3131),
    ("friction is the slope of the block and nears its limit for ever", "ebm-bouc-wen", 41, 3377),
    ("tips as gravity jumps", "ebm-bouc-wen", 42, 4402),
    ("on a wall beyond Painleve's limit, where both a push and a pull fit", "ebm-bouc-wen", 1, 79416),
    ("on a wall beyond Painleve's limit, where neither fits", "ebm-bouc-wen", 1, 18589),
    ("wedged, with all the friction there is", "ebm-bouc-wen", 1, 31864),
    ("at rest beside a wall as gravity passes zero", "ebm-bouc-wen", 1, 40963),
    ("bounces between walls nearer than its friction yields", "ebm-bouc-wen", 1, 83017),
    ("hangs hardly pushed, friction above its slope", "ebm-bouc-wen", 1, 48199),
    ("hangs hardly pushed, friction below its slope", "ebm-bouc-wen", 1, 52194),
    ("hangs by no push at all, friction below its slope", "ebm-bouc-wen", 1, 75275),
    ("slides with friction that is its slope", "ebm-bouc-wen", 1, 57608),
    ("leaves the wall that held it as gravity vanishes", "ebm-bouc-wen", 2, 26903),
    ("tips just before gravity vanishes", "ebm-bouc-wen", 3, 15814),
    ("tips by a push that is rounding as gravity vanishes", "ebm-bouc-wen", 1, 14361),
    ("stands without friction on a wall as gravity vanishes", "ebm-bouc-wen", 2, 74848),
    ("stands on its corner without friction", "ebm-bouc-wen", 43, 10501),
]


@pytest.mark.parametrize(("fault", "label", "seed", "number"), FOUND, ids=[one[0] for one in FOUND])
def test_a_fault_that_was_found(fault: str, label: str, seed: int, number: int):
    player = PLAYERS[label]
    played = player.check(player.scene(seed, number), seed, number)
    assert played.broken == [], (fault, played)
