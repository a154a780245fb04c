"""What deploy/security/policy.xml allows: enclave -> what it publishes, hears, offers, asks for."""

from pathlib import Path

from lxml import etree

FOLDER = Path(__file__).resolve().parents[2] / 'deploy' / 'security'
RULES = {('topics', 'publish'), ('topics', 'subscribe'), ('services', 'reply'),
         ('services', 'request')}


def tree(path=FOLDER / 'policy.xml'):
    """Return the policy with what it includes, as sros2 loads it."""
    found = etree.parse(str(path))
    found.xinclude()
    return found


def resolved(name, namespace, node):
    """Return a full name, as ROS resolves it."""
    base = namespace.rstrip('/')
    if name.startswith('/'):
        return name
    return f'{base}/{node}/{name[2:]}' if name.startswith('~/') else f'{base}/{name}'


def allowed(path=FOLDER / 'policy.xml'):
    """Return enclave -> (kind, direction) -> full names; `*` stands for all."""
    found = {}
    for enclave in tree(path).findall('enclaves/enclave'):
        rules = {rule: set() for rule in RULES}
        for profile in enclave.iter('profile'):
            for group in profile:
                for direction in group.attrib:
                    if (group.tag, direction) in RULES:
                        rules[group.tag, direction] |= {
                            resolved(one.text, profile.get('ns'), profile.get('node'))
                            for one in group}
        found[enclave.get('path')] = rules
    return found
