/* How members lie in the memory of a device: number i of member k of n stands at [i * n + k]. */
#ifndef MECH_ITEM_LAYOUT_H
#define MECH_ITEM_LAYOUT_H

/* The first numbers; behind them y[ny], atol[ny] and what was found so far of what is kept [n_kept], then what the device alone
 * reads: dy[ny] and what its method goes on with. */
enum mech_item_number {
    MECH_ITEM_T = 0, MECH_ITEM_RTOL, MECH_ITEM_LONGEST, MECH_ITEM_MOST, MECH_ITEM_STEPS, MECH_ITEM_SINCE, MECH_ITEM_DT,
    MECH_ITEM_ERROR_OLD, MECH_ITEM_NEXT_LOOK, MECH_ITEM_ORDER, MECH_ITEM_SINGLES
};

/* Marks: how far it is, rows of the grid that are written, looks at stiffness, whether the last step was taken. */
enum mech_item_mark {
    MECH_ITEM_STATUS = 0, MECH_ITEM_ROWS, MECH_ITEM_STIFF, MECH_ITEM_CALM, MECH_ITEM_REJECTED, MECH_ITEM_MARKS
};

enum mech_item_status { MECH_ITEM_FRESH = 0, MECH_ITEM_RUNS, MECH_ITEM_REACHED, MECH_ITEM_FULL, MECH_ITEM_TROUBLED };

#endif
