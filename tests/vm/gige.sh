# In the guest: a camera behind a cable that loses packets. Containers' kernels often have no netem.
set -e
modprobe veth
modprobe sch_netem
"$HUELINE_BIN/drivers_gige_test" --gtest_filter='GigeCable.PacketsLost*'
