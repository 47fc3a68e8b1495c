"""What a shared line means for its drives: who looks after a motor whose program is gone."""
