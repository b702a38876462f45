# In the guest: /dev/pps0 at an emulated parallel port, whose strobe raises the interrupt.
set -e
modprobe parport_pc
modprobe pps_parport
ls /dev/pps0
"$HUELINE_BIN/vm_pps_test"
