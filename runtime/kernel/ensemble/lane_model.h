/* What generated lanes end with: the struct through which the ensemble calls them. Included behind the method. */

#define LANE_TEXT(x) LANE_TEXT_OF(x)
#define LANE_TEXT_OF(x) #x

static const mech_lanes lanes = {
    .version = MECH_LANES_VERSION,
    .width = WIDTH,
    .groups = GROUPS,
    .fused = LANE_FUSED,
    .ny = NY,
    .n_all = N_ALL,
    .nz = NZ,
    .nu = NU,
    .n_kept = N_KEPT,
    .n_dense = N_DENSE,
    .n_extra = N_EXTRA,
    .plain = LANE_PLAIN,
    .build = LANE_TEXT(MECH_LANE_WIDTH) " lanes (" LANE_NAME LANE_HOW ")",
    .look_every = LOOK_EVERY,
    .stiffness_bound = STIFFNESS_BOUND,
    .begin = begin,
    .attempt = attempt,
};

#if defined(_WIN32)
__declspec(dllexport)
#else
__attribute__((visibility("default")))
#endif
const mech_lanes *mech_lanes_get(void);

const mech_lanes *mech_lanes_get(void) { return &lanes; }
