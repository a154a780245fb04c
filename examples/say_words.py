"""
Say words to a controller that ships; get its walk as arrays and a picture. No ROS needed.

Install:   pip install '.[train]'     (or in the checkout: make setup)
Usage:     python examples/say_words.py [--seconds 10] [--out walk.png] [WORD ...]
Output:    one line a word, and a picture of the paths seen from above
Run time:  about 5 s a word of 10 s (PyBullet, one core)
"""

import argparse

from w2b_sim.talk import talk

parser = argparse.ArgumentParser(description=__doc__,
                                 formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument('words', nargs='*', default=['march', 'halt', 'revert'])
parser.add_argument('--controller', default='physical_twin', help='a name that ships, or a file')
parser.add_argument('--seconds', type=float, default=10.0, help='for each word (default: 10)')
parser.add_argument('--out', default='walk.png', help='picture (default: walk.png)')
options = parser.parse_args()

walk = talk(options.controller, options.words, seconds=options.seconds)
for index, word in enumerate(walk.texts):
    outcome = walk.outcome(index)
    print(f'{word}: {outcome.along_m:+.2f} m ahead, {outcome.across_m:+.2f} m to the left; '
          f'{walk.answers[index].message}')
joints = walk.recording.joint_position_rad
print(f'joint angles: {joints.shape[0]} frames x {joints.shape[1]} joints, '
      f'{joints.min():+.2f} to {joints.max():+.2f} rad')
walk.plot(options.out)
print(options.out)
