# SPDX-License-Identifier: Apache-2.0
# Debian's PREEMPT_RT kernel: fetched, unpacked and completed in build/rig/kernel, never installed. Sourced by
# run.

kernel_dir=$rig_cache/kernel
kernel_root=$kernel_dir/root  # the packages, unpacked
vmlinux=$kernel_dir/vmlinux

# The package that linux-image-rt-amd64 stands for today, or nothing when apt has none.
resolve_kernel() {
  apt-cache depends linux-image-rt-amd64 2> /dev/null |
    sed -n 's/^ *Depends: \(linux-image-[0-9].*-rt-amd64\)$/\1/p' | head -n 1
}

# Leaves $vmlinux, $kernel_release and the modules under $kernel_root. The kernel that an earlier run has
# fetched serves as long as apt names no newer one, and without a network, too.
prepare_kernel() {
  local package version wanted
  package=$(resolve_kernel)
  if [ -z "$package" ] && [ ! -s "$kernel_dir/complete" ]; then
    as_root apt-get update -qq || missing "apt's package lists (apt-get update failed: is there a network?)"
    package=$(resolve_kernel)
    [ -n "$package" ] || missing "linux-image-rt-amd64 in apt's package lists"
  fi
  if [ -n "$package" ]; then
    version=$(apt-cache policy "$package" | sed -n 's/^ *Candidate: //p')
    wanted="${package#linux-image-} $version $(cat "$rig/modules/Kbuild" "$rig/host/kernel.sh" | cksum)"
    if [ "$(cat "$kernel_dir/complete" 2> /dev/null)" != "$wanted" ]; then
      rm -rf "$kernel_dir"
      mkdir -p "$kernel_dir/packages"
      phase "kernel and sources: download" fetch_kernel "${package#linux-image-}" "$version"
      phase "kernel: unpack" unpack_kernel "${package#linux-image-}"
      phase "drivers: build" build_drivers "${package#linux-image-}"
      rm -r "$kernel_dir/packages"
      printf '%s' "$wanted" > "$kernel_dir/complete"
    fi
  fi
  read -r kernel_release _ < "$kernel_dir/complete" || true
}

# fetch_kernel RELEASE VERSION: the image, and the packages that drivers are built from. All are of one
# version except kbuild: the headers also accept a later one, and Debian may have no other.
fetch_kernel() {
  local release=$1 version=$2 series
  series=$(cut -d. -f1,2 <<< "$release")
  (cd "$kernel_dir/packages" && apt-get download -qq \
    "linux-image-$release=$version" "linux-headers-$release=$version" \
    "linux-headers-${release%-rt-amd64}-common-rt=$version" "linux-kbuild-$series" \
    "linux-source-$series=$version") 2> "$kernel_dir/download.log" ||
    { cat "$kernel_dir/download.log" >&2
      missing "the kernel's packages (apt-get download failed: is there a network?)"; }
}

unpack_kernel() {
  local release=$1 deb image setup_sectors offset length
  for deb in "$kernel_dir"/packages/*.deb; do dpkg -x "$deb" "$kernel_root"; done
  # Uncompressed, it starts in half the time. Where its xz payload lies the setup header says (Linux,
  # Documentation/x86/boot.rst: setup_sects, payload_offset, payload_length).
  image=$kernel_root/boot/vmlinuz-$release
  setup_sectors=$(od -An -tu1 -j $((0x1f1)) -N 1 "$image")
  offset=$(od -An -tu4 -j $((0x248)) -N 4 "$image")
  length=$(od -An -tu4 -j $((0x24c)) -N 4 "$image")
  # Behind the payload follows its size, which to xz is no stream.
  head -c $(((setup_sectors + 1) * 512 + offset + length)) "$image" | tail -c $((length)) |
    xz -dc --single-stream > "$vmlinux" || fail "no xz payload in $image"
}

# build_drivers RELEASE: gpio-sim, what it stands on, and pwm-pca9685, as modules beside the kernel's own.
build_drivers() {
  local release=$1 sources=$kernel_dir/drivers headers=$kernel_root/usr/src/linux-headers-$1 file
  local wanted=(drivers/gpio/gpio-sim.c drivers/gpio/gpiolib.h kernel/irq/irq_sim.c drivers/pwm/pwm-pca9685.c)
  mkdir -p "$sources"
  for file in "$kernel_root"/usr/src/linux-source-*.tar.xz; do
    tar -xJf "$file" -C "$sources" --no-anchored --strip-components=3 "${wanted[@]}" ||
      fail "not all of these are in $file: ${wanted[*]}"
    rm "$file"
  done
  cp "$rig/modules/Kbuild" "$sources/"
  # As a module it has no irq_to_desc(), and must state its licence.
  sed -i -e 's/handle_simple_irq(irq_to_desc(irqnum))/generic_handle_irq_safe(irqnum)/' \
    -e '$a #include <linux/module.h>\nMODULE_LICENSE("GPL");' "$sources/irq_sim.c"
  # The headers' makefile names the common ones where they would be installed.
  sed -i "s|^include /|include $kernel_root/|" "$headers/Makefile"
  make -C "$headers" M="$sources" modules > "$kernel_dir/drivers.log" 2>&1 ||
    { cat "$kernel_dir/drivers.log" >&2; fail "the drivers do not build"; }
  mkdir -p "$kernel_root/lib/modules/$release/updates"
  cp "$sources"/*.ko "$kernel_root/lib/modules/$release/updates/"
  rm -f "$kernel_root/lib/modules/$release"/{build,source}
  depmod -b "$kernel_root" "$release"
}

# make_initramfs FILE: busybox, the modules that it takes to mount the host's files, and guest/init.
make_initramfs() {
  local tree=$scratch/initramfs module
  mkdir -p "$tree"/{bin,modules,proc,sys,dev,host,top,root}
  cp "$(command -v busybox)" "$tree/bin/"
  cp "$rig/guest/init" "$tree/init"
  for module in virtio_pci virtio_console 9pnet_virtio 9p overlay; do
    modprobe -d "$kernel_root" -S "$kernel_release" --show-depends "$module"
  done | awk '$1 == "insmod" && !seen[$2]++ { print $2 }' > "$scratch/modules"
  while read -r module; do
    cp "$module" "$tree/modules/"
    basename "$module"
  done < "$scratch/modules" > "$tree/modules/order"
  (cd "$tree" && find . | cpio --quiet -o -H newc) > "$1"
}
