#include "graph/tool/select.h"

static void swap(float *a, float *b)
{
    float t = *a;
    *a = *b;
    *b = t;
}

/* Hoare's selection with the median of three as pivot. Equal values go to either side, so that maps that are
 * mostly zero do not take quadratic time. */
float rl_select(float *values, size_t n, size_t k)
{
    size_t low = 0, high = n - 1;
    while (low < high) {
        size_t middle = low + (high - low) / 2, i = low, j = high;
        if (values[middle] < values[low])
            swap(&values[middle], &values[low]);
        if (values[high] < values[low])
            swap(&values[high], &values[low]);
        if (values[high] < values[middle])
            swap(&values[high], &values[middle]);
        float pivot = values[middle];
        for (;;) {
            while (values[i] < pivot)
                i++;
            while (values[j] > pivot)
                j--;
            if (i >= j)
                break;
            swap(&values[i++], &values[j--]);
        }
        /* Everything up to j is at most the pivot, everything behind it at least; low <= j < high, since the
         * ends hold a value on either side of the pivot. */
        if (k <= j)
            high = j;
        else
            low = j + 1;
    }
    return values[k];
}
