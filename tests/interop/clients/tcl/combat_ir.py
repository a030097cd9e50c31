# SPDX-License-Identifier: Apache-2.0
# Back end of omniidl (-bcombat_ir): prints the definitions as the `combat::ir add` command that Combat reads.
# Combat's own idl2tcl would do the same, but only from a running interface repository, which Debian does not
# have.
from omniidl import idlast, idltype

NAMES = {
    idltype.tk_void: 'void',
    idltype.tk_boolean: 'boolean',
    idltype.tk_long: 'long',
    idltype.tk_ulong: '{unsigned long}',
    idltype.tk_ulonglong: '{unsigned long long}',
    idltype.tk_double: 'double',
    idltype.tk_string: 'string',
}


def tcl_list(items):
    return '{' + ' '.join(items) + '}'


def header(node, name):
    return tcl_list([node.repoId(), name, '1.0'])


def type_name(t):
    if isinstance(t, idltype.Declared):
        return t.decl().repoId()
    if isinstance(t, idltype.Sequence):
        return tcl_list(['sequence', type_name(t.seqType()), str(t.bound())])
    return NAMES[t.kind()]


def members(node):
    return tcl_list(tcl_list([d.identifier(), type_name(m.memberType())])
                    for m in node.members() for d in m.declarators())


def parameter(p):
    return tcl_list([('in', 'out', 'inout')[p.direction()], p.identifier(), type_name(p.paramType())])


def items(node):
    """The items that one node of the syntax tree gives."""
    def item(kind, *rest, of=node):
        return tcl_list([kind, header(of, of.identifier()), *rest])

    def contents(nodes):
        return tcl_list(i for n in nodes for i in items(n))

    if isinstance(node, idlast.Module):
        return [item('module', contents(node.definitions()))]
    if isinstance(node, idlast.Interface):
        bases = tcl_list(base.repoId() for base in node.inherits())
        return [item('interface', bases, contents(node.contents()))]
    if isinstance(node, idlast.Typedef):
        return [item('typedef', type_name(node.aliasType()), of=d) for d in node.declarators()]
    if isinstance(node, idlast.Attribute):
        mode = ['readonly'] if node.readonly() else []
        return [item('attribute', type_name(node.attrType()), *mode, of=d) for d in node.declarators()]
    if isinstance(node, idlast.Operation):
        return [item('operation', type_name(node.returnType()), tcl_list(map(parameter, node.parameters())),
                     tcl_list(e.repoId() for e in node.raises()))]
    if isinstance(node, idlast.Const):
        return []  # Combat has no use for it
    if isinstance(node, idlast.Struct):
        return [item('struct', members(node), '{}')]
    if isinstance(node, idlast.Exception):
        return [item('exception', members(node), '{}')]
    if isinstance(node, idlast.Enum):
        return [item('enum', tcl_list(e.identifier() for e in node.enumerators()))]
    raise NotImplementedError(type(node).__name__)


def run(tree, _arguments):
    print('combat::ir add', tcl_list(i for node in tree.declarations() for i in items(node)))
