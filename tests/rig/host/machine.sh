# SPDX-License-Identifier: Apache-2.0
# The virtual machine: one boot, one command, its output and its exit status. Sourced by run.

# in_guest BOOT SILENCE_S COMMAND...: BOOT is `plain` (two processors, as quick as it goes) or `counted` (one
# processor, whose time is counted in instructions). It returns the command's exit status, 1 where the machine
# gives none or prints nothing for SILENCE_S seconds. The speed of the host thus ends no boot that goes on.
in_guest() {
  local boot=$1 silence_s=$2 is_silent=false status processor kernel_log=$rig_cache/kernel.log
  shift 2
  case $boot in
    plain) processor=(-accel tcg,thread=multi -smp 2) ;;
    counted) processor=(-accel tcg,thread=single -icount shift=1,sleep=off -smp 1) ;;
  esac
  {
    printf 'export CORBOT_RIG_BOOT=%q CORBOT_BIN=%q PATH=%q:$PATH\n' "$boot" "$binaries" "$binaries"
    if [ -n "${CORBOT_PRESSES:-}" ]; then printf 'export CORBOT_PRESSES=%q\n' "$CORBOT_PRESSES"; fi
    printf 'cd %q\n' "$PWD"
    printf '%q ' "$@"
  } > "$exchange/command"
  rm -f "$exchange/status"
  wire_machine

  # At the end of its standard input QEMU would take the port for the output as closed: one that never ends.
  mkfifo "$scratch/silence" "$scratch/lines"
  setpriv --pdeathsig TERM qemu-system-x86_64 "${processor[@]}" -cpu max -m 768 \
    -nodefaults -no-user-config -display none -no-reboot \
    -kernel "$vmlinux" -initrd "$scratch/initramfs.cpio" -append "$(kernel_arguments)" \
    "${wiring[@]}" <> "$scratch/silence" > "$scratch/lines" 2> "$scratch/qemu.log" &
  machine=$!
  if ! pass_lines "$silence_s" < "$scratch/lines"; then
    is_silent=true
    end_process "$machine"
  fi
  wait "$machine" || true
  machine=''
  rm -f "$scratch"/*.socket "$scratch/silence" "$scratch/lines"
  if ! status=$(cat "$exchange/status" 2> /dev/null); then
    tail -n 30 "$kernel_log" "$scratch/qemu.log" >&2
    if $is_silent; then printf 'the machine printed nothing for %s s\n' "$silence_s" >&2; fi
    printf 'the machine ended without a result; its messages are in %s\n' "$kernel_log" >&2
    return 1
  fi
  return "$status"
}

kernel_arguments() {
  # Without tsc=reliable the clock would be the HPET, which takes an emulated access each time it is read.
  printf '%s ' console=ttyS0 quiet panic=-1 mitigations=off nokaslr tsc=reliable cryptomgr.notests audit=0 \
    lsm= \
    net.ifnames=0 "RIG_SHARED=$shared" "RIG_EXCHANGE=$exchange" "RIG_START=$PWD/$rig/guest/start" \
    "RIG_MODULES=$kernel_root/lib/modules"
}

# Sets `wiring`: what is plugged into the machine.
wire_machine() {
  wiring=(
    # The host's files to read, the build tree to write.
    -fsdev "local,id=host,path=/,security_model=none,readonly=on,multidevs=remap"
    -device virtio-9p-pci,fsdev=host,mount_tag=host
    -fsdev "local,id=shared,path=$shared,security_model=none"
    -device virtio-9p-pci,fsdev=shared,mount_tag=shared
    -object rng-random,id=rng,filename=/dev/urandom -device virtio-rng-pci,rng=rng
    # The kernel's messages, and beside them, on ports of their own, what the command prints.
    -serial "file:$rig_cache/kernel.log"
    -device virtio-serial-pci,max_ports=8
    -chardev stdio,id=output,signal=off -device virtserialport,chardev=output,name=output
    # Two CAN controllers on one bus.
    -object can-bus,id=can -device kvaser_pci,canbus=can -device kvaser_pci,canbus=can
  )
  # Serial lines, whose far ends come back into the machine for the emulated devices there.
  add_cable ttyS1
  wiring+=(-device isa-serial,chardev=ttyS1,index=1)
  add_cable ttyUSB0
  wiring+=(-device qemu-xhci,id=usb -device usb-serial,id=plug,chardev=ttyUSB0)
  # The machine's own controls, for cases that pull the plug.
  add_cable control
  wiring+=(-mon chardev=control,mode=control)
}

# add_cable NAME: a chardev NAME, and the port NAME in the guest, joined by a socket.
add_cable() {
  wiring+=(
    -chardev "socket,id=$1,path=$scratch/$1.socket,server=on,wait=off"
    -chardev "socket,id=$1_far,path=$scratch/$1.socket" -device "virtserialport,chardev=$1_far,name=$1"
  )
}
