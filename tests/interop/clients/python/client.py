# SPDX-License-Identifier: Apache-2.0
# Test client of Corbot::Arm over omniORBpy: reads a command a line, answers each with one line. It knows no
# operation by name.
import re
import sys
import threading

from omniORB import CORBA, EnumItem
import CosNaming
import Corbot

orb = CORBA.ORB_init([], CORBA.ORB_ID)
arm = None
begun = {}


class Misuse(Exception):
    """A command that this client does not understand."""


def narrow(reference):
    found = reference._narrow(Corbot.Arm)
    if found is None:
        raise CORBA.BAD_PARAM()
    return found


def members(value):
    return '{' + ' '.join(f'{name}={text(member)}' for name, member in vars(value).items()
                          if not name.startswith('_')) + '}'


def text(value):
    if isinstance(value, bool):
        return 'true' if value else 'false'
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return '"' + value.replace('\\', '\\\\').replace('"', '\\"') + '"'
    if isinstance(value, EnumItem):
        return value._n
    if isinstance(value, (list, tuple)):
        return '[' + ' '.join(map(text, value)) + ']'
    if isinstance(value, CORBA.Object):
        return orb.object_to_string(value)
    return members(value)


def number(word):
    try:
        return int(word)
    except ValueError:
        return float(word)


def scalar(word):
    """A number, a member of an enumeration, or else a string."""
    try:
        return number(word)
    except ValueError:
        item = getattr(Corbot, word, None)
        return item if isinstance(item, EnumItem) else word


def struct(members):
    """Return the structure of these members.
    Their number tells its kind: Point {x y z}, Quaternion {w x y z}, Pose {Point Quaternion}.
    """
    of = {2: Corbot.Pose, 3: Corbot.Point, 4: Corbot.Quaternion}.get(len(members))
    if of is None:
        raise Misuse(f'no structure has {len(members)} members')
    return of(*[float(m) if isinstance(m, int) else m for m in members])


def arguments(words, end=None):
    """Return the arguments that the words spell, up to the bracket `end`.
    They are numbers, strings, enumerations, structures {...} and sequences [...].
    """
    found = []
    words = iter(words)
    for word in words:
        if word == end:
            return found
        if word == '{':
            found.append(struct(arguments(words, '}')))
        elif word == '[':
            found.append([float(v) for v in arguments(words, ']')])
        else:
            found.append(scalar(word))
    if end is not None:
        raise Misuse(f'{end} is missing')
    return found


def call(line):
    words = re.sub(r'([][{}])', r' \1 ', line).split()
    operation = getattr(arm, words[0], None)
    if operation is None or words[0].startswith('_'):
        raise Misuse(f'no operation {words[0]}')
    try:
        result = operation(*arguments(words[1:]))
    except TypeError as misuse:
        raise Misuse(str(misuse)) from misuse
    return 'ok' if result is None else 'ok ' + text(result)


def answered(function, *values):
    """Returns the answer of the function, or the one that stands for its exception."""
    try:
        return function(*values)
    except CORBA.UserException as raised:
        return f'exception {type(raised).__name__} {members(raised)}'
    except CORBA.SystemException as raised:
        return f'exception SYSTEM:{type(raised).__name__}'
    except (Misuse, ValueError) as misuse:
        return f'error {misuse}'


def begin(tag, line):
    done = []
    thread = threading.Thread(target=lambda: done.append(answered(call, line)))
    thread.start()
    begun[tag] = (thread, done)
    return 'ok'


def end(tag):
    if tag not in begun:
        raise Misuse(f'nothing was begun as {tag}')
    thread, done = begun.pop(tag)
    thread.join()
    return done[0]


def answer(line):
    global arm
    command, _, rest = line.strip().partition(' ')
    first, _, more = rest.partition(' ')
    if command == 'connect':
        arm = narrow(orb.string_to_object(first))
        return 'ok'
    if command == 'resolve':
        context = orb.string_to_object(first)._narrow(CosNaming.NamingContextExt)
        arm = narrow(context.resolve_str(more))
        return 'ok'
    if command == 'get':
        return 'ok ' + text(getattr(arm, '_get_' + first)())
    if command == 'call':
        return call(rest)
    if command == 'begin':
        return begin(first, more)
    if command == 'end':
        return end(first)
    raise Misuse(f'no command {command}')


for command_line in sys.stdin:
    print(answered(answer, command_line).replace('\n', ' '), flush=True)
