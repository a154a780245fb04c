"""Results with known answers, as a store would hold them, for the tests of the report's numbers."""

from __future__ import annotations

import numpy as np
import pandas as pd

from training.evolution.treatments import draw_words


def tables(bodies: dict[tuple[str, str], float], *, seeds: int = 12) -> dict[str, pd.DataFrame]:
    """
    Return runs and outcomes of `bodies` ((word set, body) -> typical move, m).

    Experimental champions stop under the unheard word, control champions move under it; under the
    trained words all do what is asked. Bodies are 0.1 m long.
    """
    rng = np.random.default_rng(0)
    runs, outcomes, history, robustness = [], [], [], []
    for (word_set, body), scale in bodies.items():
        for treatment in ('experimental', 'control'):
            for seed in range(seeds):
                key = {'run': f'{word_set}-{body}-{treatment}-{seed:04d}', 'word_set': word_set,
                       'body': body, 'treatment': treatment, 'seed': seed}
                trained, held_out = draw_words(word_set, seed)
                runs.append({
                    **key, 'fitness': scale * rng.normal(2, 0.1), 'body_length_m': 0.1,
                    'wall_s': 20.0 + seed, 'engine_s': 18.0, 'cpu_s': np.nan, 'generations': 100,
                    'objective': 'program', 'evaluations': 25000, 'git_commit': 'abc',
                    'evolution_seed': seed, 'held_out': held_out[0][0], 'vocabulary': 'default',
                    'engine': 'batched', 'precision': 'float32'})
                for role, pairs in (('trained', trained), ('held_out', held_out)):
                    for word, behaviour in pairs:
                        moves = behaviour != 'stop' or (role == 'held_out'
                                                        and treatment == 'control')
                        x = scale * rng.uniform(*((0.8, 1.2) if moves else (0.0, 0.1)))
                        x = -x if behaviour == 'backward' else x
                        place = {'final_x_m': x, 'final_y_m': 0.0, 'final_z_m': 0.1,
                                 'path_m': abs(x), 'largest_step_m': 0.01,
                                 'displacement_m': abs(x)}
                        outcomes.append({**key, 'word': word, 'behaviour': behaviour,
                                         'role': role, 'score': 0.0, **place})
                        robustness.append({**key, 'condition': 'perturbed', 'engine': 'batched',
                                           'word': word, 'word_class': behaviour, 'role': role,
                                           'start': 0, **place})
                for number, (word, word_class) in enumerate((
                        ('ahead', 'forward'), ('back', 'backward'), ('pause', 'stop'),
                        ('wait', 'stop'), ('doctor', 'unrelated'), ('text', 'unrelated'))):
                    # Experimental champions stop under stop words only, control ones under all.
                    still = treatment == 'control' or word_class == 'stop'
                    x = 0.0 if still else (-scale if word_class == 'backward' else scale)
                    robustness.append({
                        **key, 'condition': 'lexicon', 'engine': 'batched', 'word': word,
                        'word_class': word_class, 'role': 'lexicon', 'start': number,
                        'final_x_m': x, 'final_y_m': 0.0, 'final_z_m': 0.1, 'path_m': abs(x),
                        'largest_step_m': 0.01, 'displacement_m': abs(x)})
                history += [{**key, 'generation': generation, 'best_fitness': scale * generation
                             / 50} for generation in (1, 50, 100)]
    return {name: pd.DataFrame(rows) for name, rows in (
        ('runs', runs), ('outcomes', outcomes), ('history', history),
        ('robustness', robustness))}
