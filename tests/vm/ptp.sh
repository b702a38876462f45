# In the guest: /dev/ptp0, a clock of our own module, whose folder is $HUELINE_MODULES. The test program loads it in each of its kinds.
set -e
modprobe ptp
"$HUELINE_BIN/vm_ptp_test"
