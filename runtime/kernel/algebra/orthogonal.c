/* Householder reflections with pivoting by columns.
 *
 * G. Golub, C. Van Loan, Matrix Computations, 4th ed., Johns Hopkins 2013, section 5.4.2.
 */
#include "orthogonal.h"

static mech_real length(const mech_real *x, int n)
{
    mech_real largest = 0, sum = 0;
    for (int i = 0; i < n; i++) largest = mech_max(largest, mech_abs(x[i]));
    if (!(largest > 0)) return 0;
    for (int i = 0; i < n; i++) sum += (x[i] / largest) * (x[i] / largest);
    return largest * mech_sqrt(sum);
}

/* x -= 2 w (w' x) / (w' w) with w = (head, tail...), where head (head - pivot) = w' w / 2. */
static void reflect(mech_real head, const mech_real *tail, mech_real pivot, int n, mech_real *x)
{
    mech_real sum = head * x[0];
    for (int i = 1; i < n; i++) sum += tail[i] * x[i];
    sum /= -head * pivot;
    x[0] -= sum * head;
    for (int i = 1; i < n; i++) x[i] -= sum * tail[i];
}

static void swap_columns(mech_orthogonal *o, int k, int j)
{
    if (k == j) return;
    for (int i = 0; i < o->rows; i++) {
        const mech_real kept = o->a[(size_t)k * o->rows + i];
        o->a[(size_t)k * o->rows + i] = o->a[(size_t)j * o->rows + i];
        o->a[(size_t)j * o->rows + i] = kept;
    }
    const int kept = o->order[k];
    o->order[k] = o->order[j];
    o->order[j] = kept;
}

void mech_orthogonalise(mech_orthogonal *o, mech_real share)
{
    const int most = o->rows < o->cols ? o->rows : o->cols;
    mech_real first = 0;
    for (int j = 0; j < o->cols; j++) o->order[j] = j;
    for (o->rank = 0; o->rank < most; o->rank++) {
        const int k = o->rank, n = o->rows - k;
        int chosen = k;
        mech_real largest = -1;
        for (int j = k; j < o->cols; j++) {
            const mech_real size = length(o->a + (size_t)j * o->rows + k, n);
            if (size > largest) largest = size, chosen = j;
        }
        if (k == 0) first = largest;
        if (!(largest > share * first)) break;
        swap_columns(o, k, chosen);
        mech_real *x = o->a + (size_t)k * o->rows + k;
        const mech_real pivot = x[0] > 0 ? -largest : largest; /* x becomes (pivot, 0...) */
        o->head[k] = x[0] - pivot;
        x[0] = pivot;
        for (int j = k + 1; j < o->cols; j++) reflect(o->head[k], x, pivot, n, o->a + (size_t)j * o->rows + k);
    }
}

void mech_rotate(const mech_orthogonal *o, int transposed, mech_real *x)
{
    for (int i = 0; i < o->rank; i++) {
        const int k = transposed ? i : o->rank - 1 - i;
        const mech_real *column = o->a + (size_t)k * o->rows + k;
        reflect(o->head[k], column, column[0], o->rows - k, x + k);
    }
}

void mech_least_squares(const mech_orthogonal *o, mech_real *b, mech_real *x)
{
    mech_rotate(o, 1, b);
    for (int j = 0; j < o->cols; j++) x[j] = 0;
    for (int k = o->rank - 1; k >= 0; k--) {
        mech_real sum = b[k];
        for (int j = k + 1; j < o->rank; j++) sum -= o->a[(size_t)j * o->rows + k] * x[o->order[j]];
        x[o->order[k]] = sum / o->a[(size_t)k * o->rows + k];
    }
}
