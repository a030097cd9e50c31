# SPDX-License-Identifier: Apache-2.0
"""An independent CANopen peer, on Python's canopen package.

peer.py master BUS   drives node 1 of an emulator through everything a master does; 'ok' at the end
peer.py drives BUS N are N drives for corbot's backend: 'ready', then answers 'positions' with
                     'positions 1=COUNTS ...'

BUS: a CAN interface, or unix:/path of a virtual bus.
"""
import select
import socket
import struct
import sys
import threading
import time

import can
import canopen
from canopen.objectdictionary import ODRecord, ODVariable

FRAME = struct.Struct('=IB3x8s')
WIDTH = {canopen.objectdictionary.UNSIGNED8: 8, canopen.objectdictionary.INTEGER8: 8,
         canopen.objectdictionary.UNSIGNED16: 16, canopen.objectdictionary.UNSIGNED32: 32,
         canopen.objectdictionary.INTEGER32: 32}
U8, I8, U16, U32, I32 = WIDTH


class VirtualBus(can.BusABC):
    """A bus at a Unix socket, SOCK_SEQPACKET, a struct can_frame a packet."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.socket.connect(path)
        super().__init__(channel=path)

    def send(self, msg, timeout=None):
        self.socket.send(FRAME.pack(msg.arbitration_id, msg.dlc, bytes(msg.data)))

    def _recv_internal(self, timeout):
        if not select.select([self.socket], [], [], timeout)[0]:
            return None, False
        packet = self.socket.recv(64)
        if not packet:
            raise can.CanError('the bus was cut')
        identifier, length, data = FRAME.unpack(packet)
        return can.Message(arbitration_id=identifier, data=data[:length], is_extended_id=False,
                           timestamp=time.time()), False

    def shutdown(self):
        super().shutdown()
        self.socket.close()


def network_on(name):
    network = canopen.Network()
    if name.startswith('unix:'):
        network.bus = VirtualBus(name[5:])
        network.connect()
    else:
        network.connect(interface='socketcan', channel=name)
    return network


def dictionary(node):
    """Returns the objects of a drive after CiA 402 that the test needs."""
    od = canopen.ObjectDictionary()
    od.node_id = node

    def variable(index, name, kind, value=0, sub=0, parent=None):
        var = ODVariable(name, index, sub)
        var.data_type = kind
        var.value = var.default = value
        var.access_type = 'rw'
        var.pdo_mappable = True
        if parent is None:
            od.add_object(var)
        else:
            parent.add_member(var)

    def record(index, name, members):
        parent = ODRecord(name, index)
        for sub, (member, data_type, value) in enumerate(members):
            variable(index, member, data_type, value, sub, parent)
        od.add_object(parent)

    variable(0x1000, 'device type', U32, 0x00020192)
    variable(0x1001, 'error register', U8)
    variable(0x1005, 'SYNC identifier', U32, 0x80)
    variable(0x1017, 'producer heartbeat', U16)
    for base, mapping, cob, first in ((0x1400, 0x1600, 0x200, 0x60400010),
                                      (0x1800, 0x1A00, 0x180, 0x60410010)):
        record(base, 'parameters %X' % base,
               [('highest', U8, 2), ('identifier', U32, cob + node), ('type', U8, 255)])
        record(mapping, 'mapping %X' % mapping, [('count', U8, 1), ('1', U32, first)] +
               [(str(i), U32, 0) for i in range(2, 9)])
    variable(0x603F, 'error code', U16)
    variable(0x6040, 'controlword', U16)
    variable(0x6041, 'statusword', U16, 0x0250)
    variable(0x6060, 'mode', I8)
    variable(0x6061, 'mode display', I8)
    variable(0x6064, 'position', I32)
    variable(0x607A, 'target', I32)
    record(0x60C2, 'interpolation', [('highest', U8, 2), ('value', U8, 1), ('exponent', I8, -3)])
    variable(0x6502, 'modes', U32, 1 << 7)
    return od


class Drive:
    """A LocalNode that does what CiA 402 asks of it, and reaches every target at once."""

    def __init__(self, network, number):
        self.node = canopen.LocalNode(number, dictionary(number))
        self.network = network
        self.number = number
        self.position = 0
        self.target = 0
        self.word = 0
        self.state = 0x40
        self.lock = threading.Lock()
        network.add_node(self.node)
        self.node.sdo[0x6041].raw = self.status()
        network.subscribe(0x200 + number, self.take)
        network.subscribe(0x080, self.sync)
        self.node.add_write_callback(self.written)
        self.node.nmt.state = 'INITIALISING'
        self.node.nmt.state = 'PRE-OPERATIONAL'

    def status(self):
        return self.state | 0x0210

    def written(self, index, subindex, od, data):
        if index == 0x6060:
            self.node.sdo[0x6061].raw = int.from_bytes(data, 'little', signed=True)

    def take(self, identifier, data, timestamp):
        with self.lock:
            if len(data) == 6:
                self.word, self.target = struct.unpack('<Hi', data)

    def sync(self, identifier, data, timestamp):
        if self.node.nmt.state != 'OPERATIONAL':
            return
        mapped = [self.node.sdo[0x1A00][i].raw for i in (1, 2)]
        if mapped != [0x60410010, 0x60640020] or self.node.sdo[0x1800][2].raw != 1:
            return
        with self.lock:
            steps = {(0x40, 6): 0x21, (0x21, 7): 0x23, (0x23, 15): 0x27}
            self.state = steps.get((self.state, self.word & 0x0F), self.state)
            if self.word & 0x02 == 0:
                self.state = 0x40
            if self.state == 0x27:
                self.position = self.target
            answer = struct.pack('<Hi', self.status(), self.position)
        self.network.send_message(0x180 + self.number, answer)


def be_drives(bus, count):
    network = network_on(bus)
    drives = [Drive(network, number) for number in range(1, count + 1)]
    print('ready', flush=True)
    for line in sys.stdin:
        what = line.strip()
        values = ' '.join('%d=%d' % (d.number, d.position) for d in drives)
        print('positions ' + values if what == 'positions' else 'error', flush=True)
    network.disconnect()


def expect(what, found, wanted):
    if found != wanted:
        raise AssertionError('%s is %r, not %r' % (what, found, wanted))


def expect_abort(what, code, call):
    try:
        call()
    except canopen.SdoAbortedError as error:
        expect(what, '%08X' % error.code, '%08X' % code)
        return
    raise AssertionError(what + ' was not refused')


def be_master(bus):
    network = network_on(bus)
    od = dictionary(1)
    node = canopen.RemoteNode(1, od)
    network.add_node(node)
    booted = threading.Event()
    network.subscribe(0x701, lambda identifier, data, timestamp: booted.set() if data[0] == 0 else None)
    node.nmt.state = 'RESET'
    if not booted.wait(10):
        raise AssertionError('no boot-up message')
    sdo = node.sdo
    expect('device type', sdo[0x1000].raw, 0x00020192)
    expect('name', sdo.upload(0x1008, 0), b'corbot emulated drive')
    expect_abort('an unknown object', 0x06020000, lambda: sdo.upload(0x2000, 0))
    expect_abort('an unknown sub-index', 0x06090011, lambda: sdo.upload(0x1018, 9))
    expect_abort('a read-only object', 0x06010002, lambda: sdo.download(0x1000, 0, b'\0\0\0\0'))
    expect_abort('a short value', 0x06070013, lambda: sdo.download(0x607A, 0, b'\0\0'))
    sdo[0x1017].raw = 50
    expect('heartbeat', node.nmt.wait_for_heartbeat(10), 'PRE-OPERATIONAL')
    sdo[0x60C2][1].raw = 10
    sdo[0x6060].raw = 8
    expect('mode', sdo[0x6061].raw, 8)
    for pdo, objects in ((node.rpdo[1], (0x6040, 0x607A)), (node.tpdo[1], (0x6041, 0x6064))):
        pdo.read()
        pdo.clear()
        for index in objects:
            pdo.add_variable(index)
        pdo.trans_type = 1
        pdo.enabled = True
        pdo.save()
    expect_abort('a mapping in use', 0x08000022, lambda: sdo.download(0x1600, 0, b'\0'))
    node.nmt.state = 'OPERATIONAL'
    node.nmt.wait_for_heartbeat(10)
    out, back = node.rpdo[1], node.tpdo[1]

    answered = threading.Event()
    back.add_callback(lambda pdo: answered.set())

    def cycle(word, target):
        out[0].raw, out[1].raw = word, target
        out.transmit()
        answered.clear()
        network.sync.transmit()
        if not answered.wait(10):
            raise AssertionError('no TPDO after SYNC')
        return back[0].raw, back[1].raw

    start = cycle(0, 0)[1]
    for word, state in ((6, 0x21), (7, 0x23), (15, 0x27)):
        expect('state', cycle(word, start)[0] & 0x6F, state)
    deadline = time.monotonic() + 10
    target = start
    while cycle(15, target)[1] != start + 5000:
        target = min(target + 100, start + 5000)
        if time.monotonic() > deadline:
            raise AssertionError('the shaft does not arrive')
        time.sleep(0.001)
    expect('position', sdo[0x6064].raw, start + 5000)
    expect('state after a quick stop', cycle(0x0B, target)[0] & 0x6F, 0x07)
    node.nmt.state = 'PRE-OPERATIONAL'
    network.disconnect()
    print('ok', flush=True)


if sys.argv[1] == 'master':
    be_master(sys.argv[2])
else:
    be_drives(sys.argv[2], int(sys.argv[3]))
