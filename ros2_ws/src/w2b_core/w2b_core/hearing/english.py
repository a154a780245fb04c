"""
English that word vectors do not resolve: function words, negations, pairs of words.

Vectors of single words say nothing about *not*, and mislead about particles: *down* in *sit down*,
*left* in *turn left*. These are few, closed and known, so they are rules.
"""

from __future__ import annotations


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


#: Words that turn what follows into its opposite. Apostrophes are gone: don't is dont.
NEGATIONS = _words(
    'not no never nor neither without dont doesnt didnt cant cannot couldnt wont wouldnt shouldnt '
    'mustnt neednt isnt arent wasnt werent aint havent hasnt hadnt shant')
#: Words that carry a negation on to the next clause, and words that end it. All part clauses.
CARRYING = _words('and or nor')
ENDING = _words('but then instead rather')

#: Articles, pronouns, auxiliaries, prepositions without a direction, courtesies: no commands.
FUNCTION_WORDS = _words(
    'a an the this that these those some any each every all both such same other another '
    'i me my mine myself you your yours yourself he him his she her hers it its we us our ours '
    'they them their theirs who whom whose which what where when why how whether '
    'am is are was were be been being do does did done doing have has had having will would shall '
    'should can could may might must ought need let lets get gets got make makes made '
    'in on at of to from by with for about against between into through during above below up '
    'down out off over under upon within across per via near around among amid until till since '
    'as than like and or nor but if because although though while so yet also too very just only '
    'even ever once here there now then today again please kindly okay ok yes oh hey hi hello well '
    'bit little few lot much many more most less least one two three four five six seven eight '
    'nine ten first second last next percent robot robots everybody everyone somebody anybody '
    'sir dear quickly slowly immediately instantly gently carefully fast slow '
    'im youre were theyre ive id ill youd youll want wants wanted')

_PAIRS = {
    'stop': 'stand still|hold still|keep still|be still|sit still|lie still|stay still|hold on|'
            'hold it|stay put|stay here|stay there|shut down|power down|wind down|knock off|'
            'give up|pack in|cut out|leave off|whoa there|stand by|hang on|freeze up|time out',
    'sit': 'sit down|have seat|take seat|be seated|lie down|lay down|kneel down|squat down',
    'forward': 'go on|go ahead|go forward|go straight|carry on|keep going|keep walking|'
               'keep moving|keep on|move on|move along|move ahead|walk on|walk ahead|march on|'
               'get going|get moving|press on|push on|head on|straight on|'
               'straight ahead|right ahead|step forward|come forward|full ahead',
    'backward': 'go back|move back|walk back|step back|come back|get back|back up|back off|'
                'back away|back out|back down|fall back|pull back|turn back|head back|run back|'
                'draw back|go away|move away|walk away|step away|run away|get away|'
                'in reverse|go backward|go backwards',
    'left': 'turn left|go left|move left|walk left|step left|head left|bear left|veer left|'
            'steer left|spin left|rotate left|run left|to left',
    'right': 'turn right|go right|move right|walk right|step right|head right|bear right|'
             'veer right|steer right|spin right|rotate right|'
             'run right|to right',
}
#: Two words that mean one thing together -> the behaviour. Articles between them do not count.
PAIRS: dict[tuple[str, str], str] = {
    (first, second): behaviour for behaviour, pairs in _PAIRS.items()
    for first, second in (pair.split() for pair in pairs.split('|'))}
ARTICLES = _words('a an the your my')
#: What follows these is a thing: *take a step* asks for a motion, *the step* does not.
DEFINITE = _words('the your my this that these those his her its our their every')

#: Words that ask for a turn and do not say which.
TURNS = _words(
    'turn turns turning rotate rotates rotating spin spins spinning steer steering veer')
#: Taken literally: they cannot be learned by synonymy.
SIDES = ('left', 'right')
#: The literal word that stops in any sentence without a negation.
STOP = 'stop'

#: First words of statements and questions: what moves a robot does not begin like this. *you* may
#: be asked to walk; *he*, *the stock* and *where* are not.
STATEMENTS = _words(
    'he she it its they we i im ive who whom whose which what where when why how is are am was '
    'were does did has had there this that these those my his her our their some many most '
    'the')
#: After these words a statement is a wish after all: *i want you to go*, *it is time to go*.
WISHES = _words('want wants wish ask tell order command need time like')
